"""Whether what the paper says came out, from several answers."""

from collections.abc import Collection, Sequence

from engine_mount.experiments.harness.contract import Holds

_EVEN = 0.02  # chosen: two rms count as even within so much of each other


def holds_if(answers: Collection[bool]) -> Holds:
    """Return that it holds where all answers are yes, partly where one is; without any nothing is known."""
    if not answers:
        return Holds.NOT_COMPARABLE
    return Holds.YES if all(answers) else Holds.PARTLY if any(answers) else Holds.NO


def holds_if_lower(ratios: Sequence[float]) -> Holds:
    """Return whether it holds that all values are lower than those that they are ratios to (1)."""
    return holds_if([ratio < 1.0 - _EVEN for ratio in ratios])
