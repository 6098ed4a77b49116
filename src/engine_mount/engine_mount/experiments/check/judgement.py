"""The verdicts: each figure against its limit, the worst first."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from engine_mount.experiments.check.measures import MEASURES
from engine_mount.experiments.check.suite import Limit, Manoeuvre
from engine_mount.experiments.check.trial import GRAPH, Result


class Judged(Enum):
    """What became of a limit."""

    FAILED = 'fail'
    PASSED = 'ok'
    LEFT_OUT = 'none'
    NOT_JUDGED = 'not judged'  # the manoeuvre broke down


@dataclass(frozen=True)
class Verdict:
    """One figure against one limit; `margin` is the share that is left of it, NaN of a limit of 0."""

    manoeuvre: str
    limit: Limit
    value: float
    judged: Judged
    margin: float
    common: bool

    @property
    def has_failed(self) -> bool:
        """Whether the manoeuvre does not pass for it."""
        return self.judged in (Judged.FAILED, Judged.NOT_JUDGED)


def verdicts_of(manoeuvre: Manoeuvre, result: Result, through: str) -> list[Verdict]:
    """Return the verdicts on one manoeuvre in the order of its limits."""
    return [
        _verdict(manoeuvre.name, limit, result, through, common)
        for limits, common in ((manoeuvre.limits, False), (manoeuvre.common, True))
        for limit in limits
        if manoeuvre.seat in MEASURES[limit.measure].seats
    ]


def worst_first(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """Return the verdicts with those that failed first, then by the margin that is left."""
    order = {Judged.NOT_JUDGED: 0, Judged.FAILED: 1, Judged.PASSED: 2, Judged.LEFT_OUT: 3}

    def key(verdict: Verdict) -> tuple[int, float]:
        unknown = -math.inf if verdict.judged is Judged.FAILED else math.inf
        return order[verdict.judged], unknown if math.isnan(verdict.margin) else verdict.margin

    return sorted(verdicts, key=key)


def passed(verdicts: Sequence[Verdict]) -> bool:
    """Return whether no limit is exceeded, and none could not be judged."""
    return not any(verdict.has_failed for verdict in verdicts)


def all_verdicts(
    suite: Sequence[Manoeuvre], results: Mapping[str, Result], through: str
) -> dict[str, list[Verdict]]:
    """Return {manoeuvre: its verdicts}."""
    return {each.name: verdicts_of(each, results[each.name], through) for each in suite}


def _verdict(manoeuvre: str, limit: Limit, result: Result, through: str, common: bool) -> Verdict:
    if MEASURES[limit.measure].clock and through != GRAPH:
        return Verdict(manoeuvre, limit, math.nan, Judged.LEFT_OUT, math.nan, common)
    if result.broke_down:
        return Verdict(manoeuvre, limit, math.nan, Judged.NOT_JUDGED, math.nan, common)
    value = result.figures.get(limit.measure, math.nan)
    left = limit.value - value if limit.bound == 'at_most' else value - limit.value
    judged = Judged.PASSED if left >= 0.0 else Judged.FAILED  # a value that is not known fails
    margin = left / abs(limit.value) if limit.value else math.nan
    return Verdict(manoeuvre, limit, value, judged, margin, common)
