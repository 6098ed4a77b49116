"""What a recorded second costs in `fleet replay`, reading from the local disk included."""

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report
from engine_mount.fleet.example import VARIATIONS, make_one, whole_fleet
from engine_mount.fleet.places import Place, places
from engine_mount.fleet.replay import rows_of
from engine_mount.fleet.tables import Row

_RECORDINGS = 3  # chosen: the plain ones of the first drives; all topics of the simulator are in them
_SECONDS = 20.0  # s, chosen: of each excitation
_ROUNDS = 7
_CHANGE = {'mount_control': {'highest_current': 2.0}}


def measure(order: BenchOrder, report: Report, seconds: float = _SECONDS) -> Figures:
    """Return the processor time (s) of a recorded second; `seconds` is the length of the excitations.

    A second counts where the controller was at work, as in the figures of `fleet replay`; what a process does
    once, such as to load the compiled laws, does not count.
    """
    with TemporaryDirectory() as folder:
        drives = whole_fleet(Path(folder), seconds)
        for drive in islice(drives, 0, _RECORDINGS * len(VARIATIONS), len(VARIATIONS)):
            make_one(drive)
        found = list(places([folder]).values())
        rows = [row for place in found for row in _replay(place)]
        times = []
        for _ in range(_ROUNDS):
            begin = process_time()
            for place in found:
                _replay(place)
            times.append(process_time() - begin)
    cost = median(times) / sum(row['duration_s'] for row in rows)
    return {'fleet': Comparison('a recorded second in fleet replay', cost, 'real time', 1.0)}


def _replay(place: Place) -> Sequence[Row]:
    return rows_of(Path(place.uri), place, _CHANGE)['result']
