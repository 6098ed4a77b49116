"""Performance figures as ratios: ours and its alternative in turn, in one run, medians of several."""

import math
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

GROUPS = {'calls': 'offline', 'imports': 'offline', 'graph': 'graph'}
"""What can be measured alone: the function of this name, and its module."""

Report = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """A figure of ours and one of its alternative, in s where `unit` says nothing else."""

    what: str
    ours: float
    beside: str
    other: float
    unit: str = 's'

    @property
    def ratio(self) -> float:
        """Ours over the other."""
        return self.ours / self.other if self.other else math.nan


@dataclass(frozen=True)
class BenchOrder:
    """How the graph is measured: rounds, length of a run in s, Hz, ROS domain, real-time priority."""

    rounds: int
    seconds: float
    sample_rate: float
    domain: int
    priority: int


Figures = Mapping[str, Comparison]


def median_times(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median seconds of one call of each, measured in turn."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            begin = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - begin)
    return {name: statistics.median(each) for name, each in times.items()}
