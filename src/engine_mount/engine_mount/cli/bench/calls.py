"""What one call costs, without middleware, beside its alternative or beside real time."""

from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report, median_times
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import run_core
from engine_mount.drives.replay import replay
from engine_mount.settings.chosen import chosen_control
from mount_control.controller import ControlLaw, Controller
from mount_control.force_maker import resample
from mount_driver.can_library import cantools
from mount_driver.protocol import DATABASE_FILE, Measurement, MountCodec
from mount_models.sampling import SAMPLE_TIME
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CONTROL_TRACE

_ROUNDS = 7
_REPEATS = 2000
_DRIVEN = 20.0  # s
_STAMP = 1_700_000_000_000_000_000


def measure(order: BenchOrder, report: Report) -> Figures:
    """Return what packing, decoding, a control step, a core drive and a replay cost."""
    layout, numbers = ScalarsLayout(CONTROL_TRACE), tuple(float(n) for n in range(len(CONTROL_TRACE.names)))
    raw = layout.pack(_STAMP, numbers)
    packed = median_times(
        lambda: layout.pack(_STAMP, numbers),
        lambda: serialize_message(JointState(name=list(CONTROL_TRACE.names), position=list(numbers))),
        _ROUNDS,
        _REPEATS,
    )
    unpacked = median_times(
        lambda: layout.unpack(raw), lambda: deserialize_message(raw, JointState), _ROUNDS, _REPEATS
    )
    return {
        'pack': Comparison('pack a control_trace', packed[0], 'rclpy message', packed[1]),
        'unpack': Comparison('unpack a control_trace', unpacked[0], 'rclpy message', unpacked[1]),
        'decode': _decoding(),
        'control': _control(),
        **_drive_and_replay(),
    }


def _decoding() -> Comparison:
    """Decode one CAN frame and check it, against cantools, which does not check."""
    codec = MountCodec()
    database = cantools.database.load_file(DATABASE_FILE)
    assert isinstance(database, cantools.database.can.Database)
    message = database.get_message_by_name('MountMeasurement')
    frame = codec.encode_measurement(Measurement(7, 7000, 1e-4, 0.2, 300.0, 110.0), 7)
    ours, other = median_times(
        lambda: codec.measurement.decode(frame), lambda: message.decode(frame), _ROUNDS, _REPEATS
    )
    return Comparison('decode one CAN frame with CRC', ours, 'cantools, no CRC', other)


def _control() -> Comparison:
    table = resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    controller = Controller(ControlLaw(chosen_control({}), table))
    displacement = 1e-3 * np.sin(2.0 * np.pi * 8.0 * np.arange(60_000) * SAMPLE_TIME)
    ours = _median_time(lambda: controller.run(displacement)) / len(displacement)
    return Comparison('one control step', ours, 'real time', SAMPLE_TIME)


def _drive_and_replay() -> Figures:
    """Drive the bench in core with every message packed but not stored, and replay such a drive."""
    order = {'mount_sim': {'scenario': 'bench', 'timeline.duration': _DRIVEN}}

    def drive() -> int:
        return run_core(order, lambda *_: None, write_columns=lambda *_: None).samples

    samples = drive()
    driven = _median_time(drive) / samples
    with TemporaryDirectory() as folder:
        record_core(Path(folder) / 'recording', order, '')
        runs = [replay(Path(folder) / 'recording') for _ in range(_ROUNDS)]
        assert all(run.held for run in runs)
        replayed = median(run.replayed.control_time / run.samples for run in runs)
    return {
        'core': Comparison('one sample, plant and control', driven, 'real time', SAMPLE_TIME),
        'replay': Comparison('replay one sample', replayed, 'real time', SAMPLE_TIME),
    }


def _median_time(call: Callable[[], object]) -> float:
    times = []
    for _ in range(_ROUNDS):
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
    return median(times)
