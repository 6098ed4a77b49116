"""One fault in a graph that damps: brought in, observed, taken away, recovered from."""

import math
import time

from engine_mount.faults.fault import FaultCase, Reaction
from engine_mount.faults.graph import START_PATIENCE, GraphUnderTest
from engine_mount.faults.injections import take_through
from engine_mount.faults.matrix import ACTIVATE, DEACTIVATE
from engine_mount.faults.observers import Told, since
from engine_mount.faults.outcome import Course, Outcome, judged, tells
from mount_ros.nodes.diagnostics import Level

_END_PATIENCE = 20.0  # s, chosen: for the end of a drive that closes and audits its recording
_RECOVERY_PATIENCE = 8.0  # s, chosen
_AT_REST = 0.6  # s, chosen: so long a graph that must not recover by itself is watched
_OWN_RECOVERY = 12.0  # s, chosen: a supervisor that initialises again by itself has done so by then
_LOOK_PERIOD = 0.005  # s


def tried(case: FaultCase, graph: GraphUnderTest) -> Outcome:
    """Try one fault in a graph that damps (or, for a fault of the start, that starts) and judge it."""
    output = _Output(graph)
    case.injection.prepare(graph)
    try:
        course = Course(begun=time.monotonic())
        case.injection.begin(graph)
        _observe(case, graph, course, output)
    finally:
        cleared = time.monotonic()
        case.injection.end(graph)
    if not course.ended and not case.for_good:
        course.cleared = cleared
        _recover(case, graph, course, output)
    course.over = time.monotonic()
    course.printed = tuple(output.lines)
    outcome = judged(case, course, graph.observed)
    if graph.refusals:
        outcome.detected_by, outcome.sentence = 'each node', '; '.join(graph.refusals)
        graph.refusals.clear()
    return outcome


def _observe(case: FaultCase, graph: GraphUnderTest, course: Course, output: '_Output') -> None:
    """Wait while the fault lasts, or until the graph has ended where it must."""
    starts = case.reaction is Reaction.NOT_STARTED
    lasts = START_PATIENCE if starts else _END_PATIENCE if case.ends_drive else case.lasts
    end = course.begun + lasts
    while time.monotonic() < end and not course.ended:
        time.sleep(_LOOK_PERIOD)
        output.look()
        course.ended = graph.ended


def _recover(case: FaultCase, graph: GraphUnderTest, course: Course, output: '_Output') -> None:
    """Wait for damping; where a new initialisation is required, see that there is none before it."""
    by_hand = case.reaction is Reaction.SAFE_UNTIL_INITIALISED
    if by_hand and not _back(graph, course, _OWN_RECOVERY, output) and not course.ended:
        for node in ('mount_control', 'mount_init', 'mount_driver'):
            take_through(graph, node, DEACTIVATE)
        for node in ('mount_driver', 'mount_init', 'mount_control'):
            take_through(graph, node, ACTIVATE)
    _back(graph, course, _RECOVERY_PATIENCE, output)
    if case.reaction is Reaction.TOLD:
        graph.wait_until(lambda: _is_told(case, graph, course, output), _RECOVERY_PATIENCE)


def _is_told(case: FaultCase, graph: GraphUnderTest, course: Course, output: '_Output') -> bool:
    """Return whether a sentence has come: a supervisor tells of a node when it has brought it back."""
    output.look()
    told = [*since(graph.observed.told, course.begun), *output.lines]
    return any(tells(case, each) for each in told)


def _back(graph: GraphUnderTest, course: Course, limit: float, output: '_Output') -> bool:
    """Return whether it damps again within `limit` s."""
    end = time.monotonic() + limit
    while time.monotonic() < end and not course.ended and math.isnan(course.damping_again):
        time.sleep(_LOOK_PERIOD)
        output.look()
        course.ended = graph.ended
        if graph.damping():
            course.damping_again = time.monotonic()
    return not math.isnan(course.damping_again)


class _Output:
    """The lines that the command and its nodes print from now on, as what they tell."""

    def __init__(self, graph: GraphUnderTest):
        self.lines: list[Told] = []
        self._graph = graph
        self._known: dict[str, int] = {}
        self.look()
        self.lines.clear()

    def look(self) -> None:
        """Take what was printed since the last look."""
        now = time.monotonic()
        for name, text in self._graph.outputs().items():
            new = text[self._known.get(name, 0) :]
            whole = new[: new.rfind('\n') + 1]
            self._known[name] = self._known.get(name, 0) + len(whole)
            self.lines += [
                Told(now, name, Level.WARN, line.strip()) for line in whole.splitlines() if line.strip()
            ]
