"""How a node must warn of a burst of what it counts."""

from collections.abc import Callable

from mount_ros.nodes.diagnostics import WINDOW, ActiveFindings, Level, Verdict


def check_burst(judge: Callable[[float, int, int], Verdict]) -> None:
    """Require a warning in the same words for as long as the window of the counts lasts, and no longer.

    `judge` gives the verdict at a time (s) on so many samples with so many findings among them, which come
    within 0.5 s from 5 s on.
    """
    standing, told = ActiveFindings(), []
    for tenth in range(300):
        kept = standing.keep(judge(tenth / 10, 100 * tenth, 100 * min(max(tenth - 49, 0), 5)))
        told.append((kept.level, kept.sentence))
    warned = [tenth for tenth, (level, _) in enumerate(told) if level is Level.WARN]
    assert (warned[0], len(warned)) == (50, warned[-1] - 49)
    assert 50 + 10 * WINDOW <= warned[-1] + 1 <= 54 + 10 * WINDOW
    assert len(set(told)) == 2
