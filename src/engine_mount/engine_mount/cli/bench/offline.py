"""What costs time without middleware: a sample, a recorded second in a fleet, the loading of a recording."""

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

import engine_mount
from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report, median_times
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import run_core
from engine_mount.drives.replay import replay
from engine_mount.fleet.example import VARIATIONS, make_one, whole_fleet
from engine_mount.fleet.places import Place, places
from engine_mount.fleet.replay import rows_of
from engine_mount.fleet.tables import Row
from mount_models.sampling import SAMPLE_TIME, SAMPLE_TIME_NS
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT

_CALL_ROUNDS = 7
_DRIVE = {'mount_sim': {'scenario': 'bench', 'timeline.duration': 20.0}}


def calls(order: BenchOrder, report: Report) -> Figures:
    """Drive the bench in core with every message packed but not stored, and replay such a drive."""

    def drive() -> int:
        return run_core(_DRIVE, lambda *_: None, write_columns=lambda *_: None).samples

    samples = drive()
    driven = median_times({'drive': drive}, _CALL_ROUNDS)['drive'] / samples
    with TemporaryDirectory() as folder:
        record_core(Path(folder) / 'recording', _DRIVE, '')
        runs = [replay(Path(folder) / 'recording') for _ in range(_CALL_ROUNDS)]
    replayed = median(run.replayed.control_time / run.samples for run in runs)
    return {
        'core': Comparison('one sample, plant and control', driven, 'real time', SAMPLE_TIME),
        'replay': Comparison('replay one sample', replayed, 'real time', SAMPLE_TIME),
    }


_FLEET_RECORDINGS = 3  # chosen: the plain ones of the first drives; all topics of the simulator are in them
_SECONDS = 20.0  # s, chosen: of each excitation
_FLEET_ROUNDS = 7
_CHANGE = {'mount_control': {'highest_current': 2.0}}


def fleet(order: BenchOrder, report: Report, seconds: float = _SECONDS) -> Figures:
    """Return the processor time (s) of a recorded second; `seconds` is the length of the excitations.

    A second counts where the controller was at work, as in the figures of `fleet replay`; what a process does
    once, such as to load the compiled laws, does not count.
    """
    with TemporaryDirectory() as folder:
        drives = whole_fleet(Path(folder), seconds)
        for drive in islice(drives, 0, _FLEET_RECORDINGS * len(VARIATIONS), len(VARIATIONS)):
            make_one(drive)
        found = list(places([folder]).values())
        rows = [row for place in found for row in _replay(place)]
        times = []
        for _ in range(_FLEET_ROUNDS):
            begin = process_time()
            for place in found:
                _replay(place)
            times.append(process_time() - begin)
    cost = median(times) / sum(row['duration_s'] for row in rows)
    return {'fleet': Comparison('a recorded second in fleet replay', cost, 'real time', 1.0)}


def _replay(place: Place) -> Sequence[Row]:
    return rows_of(Path(place.uri), place, _CHANGE)['result']


_SAMPLES = 600_000
_LOAD_ROUNDS = 3
_STAMPS = 1_700_000_000_000_000_000 + SAMPLE_TIME_NS * np.arange(_SAMPLES)
_NUMBERS = np.arange(float(_SAMPLES))


def storage(order: BenchOrder, report: Report) -> Figures:
    """Return what it costs to load a message of ten minutes at 1 kHz."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with TemporaryDirectory() as folder:
        recording = Path(folder) / 'recording'
        writer = BagWriter(recording)
        writer.add_topic(f'/{DISPLACEMENT.name}', DISPLACEMENT.type)
        rows = ScalarsLayout(DISPLACEMENT).pack_rows(_STAMPS, _NUMBERS[:, None])
        writer.write_columns([f'/{DISPLACEMENT.name}'], [rows], _STAMPS)
        writer.close()

        def ours() -> None:
            series = engine_mount.open(recording)[DISPLACEMENT.name]
            _require(series.stamps, series['mount'])

        def other() -> None:
            stamps, numbers = [], []
            with Reader(recording) as reader:
                for connection, _, raw in reader.messages():
                    message = store.deserialize_cdr(raw, connection.msgtype)
                    stamp = message.header.stamp  # type: ignore[attr-defined]
                    stamps.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
                    numbers.append(message.position[0])  # type: ignore[attr-defined]
            _require(np.array(stamps), np.array(numbers))

        times = median_times({'ours': ours, 'rosbags': other}, _LOAD_ROUNDS)
    first, second = (time / _SAMPLES for time in times.values())
    return {'load': Comparison('load displacement of 10 min', first, 'rosbags', second)}


def _require(stamps: np.ndarray, numbers: np.ndarray) -> None:
    """Raise `ValueError` unless all was read: a figure of something else would mislead."""
    if not (np.array_equal(stamps, _STAMPS) and np.array_equal(numbers, _NUMBERS)):
        raise ValueError(f'{len(stamps)} of {_SAMPLES} samples were read, or read wrongly')
