"""One way to compare two speeds: ours and its alternative in turn, in one run, medians of several rounds."""

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Comparison:
    """What is compared: a number of ours and one of the other, in s where `unit` says nothing else."""

    what: str
    ours: float
    other_name: str
    other: float
    unit: str = 's'

    @property
    def ratio(self) -> float:
        """Ours over the other."""
        return self.ours / self.other if self.other else math.nan

    @property
    def figures(self) -> dict[str, Any]:
        """All of it for a JSON file; a ratio that is not known is null."""
        ratio = self.ratio if math.isfinite(self.ratio) else None
        return {
            'what': self.what,
            'ours': self.ours,
            'other': self.other,
            'beside': self.other_name,
            'unit': self.unit,
            'ratio': ratio,
        }

    @property
    def per_second(self) -> float:
        """How many ours handles in a second."""
        return 1.0 / self.ours


def in_turn(
    ours: Callable[[], object], other: Callable[[], object], rounds: int, repeats: int = 1
) -> tuple[float, float]:
    """Return the median seconds of one call of each, measured A B A B ..., `repeats` calls at a time."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for place, call in enumerate((ours, other)):
            begin = time.perf_counter()
            for _ in range(repeats):
                call()
            times[place].append((time.perf_counter() - begin) / repeats)
    return statistics.median(times[0]), statistics.median(times[1])
