"""Performance figures as ratios: ours and its alternative in turn, in one run, medians of several."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

GROUPS = ('calls', 'graph')
"""What can be measured alone: a module and its function of this name."""

Report = Callable[[str], None]


class Comparison(NamedTuple):
    """A figure of ours and one of its alternative, in s where `unit` says nothing else."""

    what: str
    ours: float
    beside: str
    other: float
    unit: str = 's'

    @property
    def ratio(self) -> float | None:
        """Ours over the other, None where that is 0."""
        return self.ours / self.other if self.other else None


class BenchOrder(NamedTuple):
    """How the graph is measured: rounds, length of a run in s, Hz, ROS domain, real-time priority."""

    rounds: int
    seconds: float
    sample_rate: float
    domain: int
    priority: int


Figures = Mapping[str, Comparison]
