"""One fault in a graph that damps: injected, observed, taken away, recovered from."""

import math
import time

from engine_mount.faults.case import FaultCase, Reaction
from engine_mount.faults.graph import LOOK_PERIOD, START_PATIENCE, GraphUnderTest
from engine_mount.faults.injection import change_states, injection
from engine_mount.faults.judge import Course, Outcome, judge, reports_fault
from engine_mount.faults.observers import Report, since
from mount_ros.nodes.diagnostics import Level

_END_PATIENCE = 20.0  # s, chosen: for the end of a drive that closes and audits its recording
_RECOVERY_PATIENCE = 8.0  # s, chosen
_OWN_RECOVERY = 12.0  # s, chosen: a supervisor that initialises again by itself has done so by then
_BY_HAND = [
    *((node, 'deactivate') for node in ('mount_control', 'mount_init', 'mount_driver')),
    *((node, 'activate') for node in ('mount_driver', 'mount_init', 'mount_control')),
]


def try_fault(case: FaultCase, graph: GraphUnderTest) -> Outcome:
    """Try one fault in a graph that damps (or, for a fault of the start, that starts) and judge it."""
    trial = _Trial(case, graph)
    with injection(case, graph) as begin:
        course = trial.course = Course(begun=time.monotonic())
        begin()
        starts = case.reaction is Reaction.NOT_STARTED
        lasts = START_PATIENCE if starts else _END_PATIENCE if case.ends_drive else case.lasts
        trial.watch(course.begun + lasts - time.monotonic())
        cleared = time.monotonic()
    if not course.ended and not case.for_good:
        course.cleared = cleared
        trial.recover()
    course.over, course.printed = time.monotonic(), trial.printed
    outcome = judge(case, course, graph.observed)
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
        self.printed: list[Report] = []
        self._read_outputs()
        self.printed.clear()

    def watch(self, limit: float, until_damping: bool = False) -> None:
        """Watch for `limit` s, until the graph has ended or damps again."""
        course, end = self.course, time.monotonic() + limit
        while time.monotonic() < end and not course.ended and math.isnan(course.damping_again):
            time.sleep(LOOK_PERIOD)
            self._read_outputs()
            course.ended = self._graph.ended
            if until_damping and self._graph.is_damping():
                course.damping_again = time.monotonic()

    def recover(self) -> None:
        """Wait for damping; where a new initialisation is required, see that there is none before it."""
        if self._case.reaction is Reaction.SAFE_UNTIL_INITIALISED:
            self.watch(_OWN_RECOVERY, until_damping=True)
            if math.isnan(self.course.damping_again) and not self.course.ended:
                change_states(self._graph, _BY_HAND)
        self.watch(_RECOVERY_PATIENCE, until_damping=True)
        if self._case.reaction is Reaction.TOLD:
            self._graph.wait_until(self._is_reported, _RECOVERY_PATIENCE)

    def _is_reported(self) -> bool:
        """Return whether a sentence has come: a supervisor reports a node when it has brought it back."""
        self._read_outputs()
        reports = [*since(self._graph.observed.reports, self.course.begun), *self.printed]
        return any(reports_fault(self._case, each) for each in reports)

    def _read_outputs(self) -> None:
        """Take the whole lines that were printed since the last call."""
        now = time.monotonic()
        for name, text in self._graph.outputs().items():
            begin, end = self._read.get(name, 0), text.rfind('\n') + 1
            self._read[name] = max(begin, end)
            lines = map(str.strip, text[begin:end].splitlines())
            self.printed += [Report(now, name, Level.WARN, line) for line in lines if line]
