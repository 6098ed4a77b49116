"""Runs faults through real graphs: one for as many as it outlives, a fresh one for those that end it."""

import itertools
import math
import os
import time
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rclpy.context import Context

import engine_mount
from engine_mount.faults.case import FaultCase, Reaction
from engine_mount.faults.graph import (
    LOOK_PERIOD,
    START_PATIENCE,
    GraphUnderTest,
    GraphUnderTestError,
    Place,
)
from engine_mount.faults.injection import change_states, injection, shim_environment
from engine_mount.faults.judge import Course, Outcome, judge, reports_fault
from engine_mount.faults.observers import Report, since
from engine_mount.recordings import ReadingError
from mount_bringup.graph.shutdown import ending_signals
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros.nodes.diagnostics import WINDOW, Level
from mount_ros.nodes.process import ros_context

_PATIENCE = WINDOW + 4.0  # s, chosen: for damping without complaint in a graph that has seen faults
_END_PATIENCE = 20.0  # s, chosen: for the end of a drive that closes and audits its recording
_RECOVERY_PATIENCE = 8.0  # s, chosen
_OWN_RECOVERY = 12.0  # s, chosen: a supervisor that initialises again by itself has done so by then
_BY_HAND = [
    *((node, 'deactivate') for node in ('mount_control', 'mount_init', 'mount_driver')),
    *((node, 'activate') for node in ('mount_driver', 'mount_init', 'mount_control')),
]
_SLACK = 1.0  # s: from the stamp of a sample to the log time of its neighbour

Progress = Callable[[float, str], None]
Tell = Callable[[FaultCase, Outcome], None]
Kind = tuple[bool, tuple[str, ...]]
"""What a graph is started with: the shim, options."""


def run_faults(
    cases: Sequence[FaultCase], place: Place, progress: Progress, tell: Tell
) -> dict[str, Outcome]:
    """Return {fault: outcome}; what the end of a graph shows is added to those that it has seen.

    `progress` takes the share that is done and the fault that is next, `tell` each outcome as it comes. The
    first SIGINT, SIGTERM or SIGHUP raises `KeyboardInterrupt`; the graph that runs is ended first.
    """
    outcomes: dict[str, Outcome] = {}
    signals = itertools.count()

    def interrupt() -> None:
        if next(signals) == 0:  # a second signal cuts no end short
            raise KeyboardInterrupt

    with ending_signals(interrupt), ros_context(place.domain) as context:
        session = _Session(place, context)
        try:
            # those of one graph follow each other, and first those that it outlives
            ordered = sorted(cases, key=lambda case: (_kind(case), case.ends_drive or case.for_good))
            for number, case in enumerate(ordered):
                progress(number / len(cases), case.name)
                outcomes[case.name] = session.outcome(case)
                tell(case, outcomes[case.name])
        finally:
            session.end_graph()
    return {case.name: outcomes[case.name] for case in cases}


def _kind(case: FaultCase) -> Kind:
    return case.shim, case.options


class _Tried(NamedTuple):
    """A fault that a graph has seen, from when to when on the system clock (s)."""

    case: FaultCase
    outcome: Outcome
    begin: float
    end: float


class _Session:
    """The graph that runs at present, if one does, and the faults that it has seen."""

    def __init__(self, place: Place, context: Context):
        self._place, self._context = place, context
        self._numbers = itertools.count(1)
        self._graph: GraphUnderTest | None = None
        self._kind: Kind = (False, ())
        self._tried: list[_Tried] = []

    def outcome(self, case: FaultCase) -> Outcome:
        """Try a fault, in the graph that runs or in a fresh one."""
        begin = time.time()
        try:
            graph = self._prepared(case)
            begin = time.time()
            outcome = try_fault(case, graph)
        except GraphUnderTestError as error:
            outcome = Outcome(complaints=[str(error)])
        if self._graph is not None:
            self._tried.append(_Tried(case, outcome, begin, time.time()))
            if self._graph.ended:
                self.end_graph()
        return outcome

    def end_graph(self) -> None:
        """End the graph that runs, and add to the faults that it has seen what its end has shown."""
        graph, tried = self._graph, self._tried
        self._graph, self._tried = None, []
        if graph is None:
            return
        wrong = graph.end()
        if tried:
            tried[-1].outcome.complaints += wrong
        for case, outcome, begin, end in tried:
            if not case.loses_samples:
                outcome.complaints += _losses(graph.folder, begin, end)

    def _prepared(self, case: FaultCase) -> GraphUnderTest:
        """Return a graph that damps without complaint, or that starts where the fault is one of the start."""
        if self._graph is not None and self._kind == _kind(case):
            try:
                self._graph.wait_for_damping(partial(reports_fault, case), _PATIENCE)
                return self._graph
            except GraphUnderTestError:
                pass  # what came before has spoiled it
        self.end_graph()
        namespace = f'faults_{os.getpid()}_{next(self._numbers)}'
        environment = shim_environment(self._place.folder) if case.shim else {}
        self._kind = _kind(case)
        graph = GraphUnderTest(self._place, self._context, namespace, case.options, environment)
        self._graph = graph
        if case.reaction is not Reaction.NOT_STARTED:
            graph.wait_for_damping(partial(reports_fault, case), START_PATIENCE)
        return graph


def _losses(folder: Path, begin: float, end: float) -> list[str]:
    """Return a sentence if a recording in `folder` lacks samples of `sim/truth` between two system times, s.

    The simulator numbers its samples without a gap, whatever happens to the graph, so each hole is a loss.
    """
    found, lost = [], 0
    for place in sorted(path for path in folder.glob('recording*') if path.is_dir()):
        stamps = _truth_stamps(place)
        if stamps is None:
            found.append(f'{place.name} cannot be read')
            continue
        steps = np.rint(np.diff(stamps) / SAMPLE_TIME_NS).astype(int) - 1
        times = 1e-9 * stamps[:-1]
        lost += int(steps[(steps > 0) & (times >= begin - _SLACK) & (times <= end + _SLACK)].sum())
    return [*found, *([f'{lost} samples of sim/truth are not in the recording'] if lost else [])]


@lru_cache(maxsize=4)
def _truth_stamps(place: Path) -> np.ndarray | None:
    """Return the stamps (ns) of `sim/truth`; None where nothing can be read."""
    try:
        recording = engine_mount.open(place)
        return recording['sim/truth'].stamps if 'sim/truth' in recording else np.empty(0, np.int64)
    except (ReadingError, KeyError):
        return None


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
