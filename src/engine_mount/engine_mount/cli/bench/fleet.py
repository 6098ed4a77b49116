"""What a recorded second costs in `fleet replay`, reading from the local disk included."""

from dataclasses import replace
from itertools import islice
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report
from engine_mount.fleet.catalogue.places import places
from engine_mount.fleet.example.fleet import make_one, whole_fleet
from engine_mount.fleet.example.variations import VARIATIONS
from engine_mount.fleet.what_if.one import replay_one

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
        for drive in islice(whole_fleet(Path(folder)), 0, _RECORDINGS * len(VARIATIONS), len(VARIATIONS)):
            make_one(replace(drive, seconds=seconds))
        found = list(places([folder]).values())
        rows = [row for place in found for row in replay_one(place, _CHANGE).rows['result']]
        times = []
        for _ in range(_ROUNDS):
            begin = process_time()
            for place in found:
                replay_one(place, _CHANGE)
            times.append(process_time() - begin)
    cost = median(times) / sum(row['duration_s'] for row in rows)
    return {'fleet': Comparison('a recorded second in fleet replay', cost, 'real time', 1.0)}
