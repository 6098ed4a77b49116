"""One fault in a graph that damps: injected, observed, taken away, recovered from."""

import math
import time

from engine_mount.faults.case import FaultCase, Reaction
from engine_mount.faults.graph import START_PATIENCE, GraphUnderTest
from engine_mount.faults.injection import injection, take_through
from engine_mount.faults.judge import Course, Outcome, judged, tells
from engine_mount.faults.observers import Told, since
from mount_ros.nodes.diagnostics import Level

_END_PATIENCE = 20.0  # s, chosen: for the end of a drive that closes and audits its recording
_RECOVERY_PATIENCE = 8.0  # s, chosen
_OWN_RECOVERY = 12.0  # s, chosen: a supervisor that initialises again by itself has done so by then
_LOOK_PERIOD = 0.005  # s


def tried(case: FaultCase, graph: GraphUnderTest) -> Outcome:
    """Try one fault in a graph that damps (or, for a fault of the start, that starts) and judge it."""
    trial = _Trial(case, graph)
    with injection(case, graph) as begin:
        course = trial.course = Course(begun=time.monotonic())
        begin()
        starts = case.reaction is Reaction.NOT_STARTED
        lasts = START_PATIENCE if starts else _END_PATIENCE if case.ends_drive else case.lasts
        trial.watch(course.begun + lasts)
        cleared = time.monotonic()
    if not course.ended and not case.for_good:
        course.cleared = cleared
        trial.recover()
    course.over = time.monotonic()
    course.printed = tuple(trial.printed)
    outcome = judged(case, course, graph.observed)
    if graph.refusals:
        outcome.detected_by, outcome.sentence = 'each node', '; '.join(graph.refusals)
        graph.refusals.clear()
    return outcome


class _Trial:
    """The course of a fault, and the lines that the command and its nodes print meanwhile."""

    def __init__(self, case: FaultCase, graph: GraphUnderTest):
        self._case, self._graph = case, graph
        self._read: dict[str, int] = {}  # characters of each output
        self.course = Course(begun=math.nan)
        self.printed: list[Told] = []
        self._look()
        self.printed.clear()

    def watch(self, end: float, until_damping: bool = False) -> bool:
        """Watch up to a time (s), until the graph has ended or damps again; return whether it damps again."""
        course = self.course
        while time.monotonic() < end and not course.ended and math.isnan(course.damping_again):
            time.sleep(_LOOK_PERIOD)
            self._look()
            course.ended = self._graph.ended
            if until_damping and self._graph.damping():
                course.damping_again = time.monotonic()
        return not math.isnan(course.damping_again)

    def recover(self) -> None:
        """Wait for damping; where a new initialisation is required, see that there is none before it."""
        by_hand = self._case.reaction is Reaction.SAFE_UNTIL_INITIALISED
        if (
            by_hand
            and not self.watch(time.monotonic() + _OWN_RECOVERY, until_damping=True)
            and not self.course.ended
        ):
            for node in ('mount_control', 'mount_init', 'mount_driver'):
                take_through(self._graph, node, 'deactivate')
            for node in ('mount_driver', 'mount_init', 'mount_control'):
                take_through(self._graph, node, 'activate')
        self.watch(time.monotonic() + _RECOVERY_PATIENCE, until_damping=True)
        if self._case.reaction is Reaction.TOLD:
            self._graph.wait_until(self._is_reported, _RECOVERY_PATIENCE)

    def _is_reported(self) -> bool:
        """Return whether a sentence has come: a supervisor reports a node when it has brought it back."""
        self._look()
        told = [*since(self._graph.observed.told, self.course.begun), *self.printed]
        return any(tells(self._case, each) for each in told)

    def _look(self) -> None:
        """Take what was printed since the last look."""
        now = time.monotonic()
        for name, text in self._graph.outputs().items():
            begin = self._read.get(name, 0)
            whole = text[begin : text.rfind('\n') + 1]
            self._read[name] = begin + len(whole)
            self.printed += [
                Told(now, name, Level.WARN, line.strip()) for line in whole.splitlines() if line.strip()
            ]
