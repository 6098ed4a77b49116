"""Runs faults through real graphs: one for as many as it outlives, a fresh one for those that end it."""

import itertools
import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial

from rclpy.context import Context
from rclpy.node import Node

from engine_mount.faults.case import FaultCase, Reaction
from engine_mount.faults.graph import Ending, GraphUnderTest, GraphUnderTestError, Place
from engine_mount.faults.injection import NonsenseTakenError, shim_environment
from engine_mount.faults.judge import Outcome, tells
from engine_mount.faults.observers import observers
from engine_mount.faults.recording_loss import lost_while
from engine_mount.faults.trial import tried
from mount_bringup.graph.domain import can_port
from mount_bringup.graph.shutdown import ending_signals
from mount_ros.nodes.diagnostics import WINDOW
from mount_ros.nodes.process import ros_context

_TRIALS = 2  # chosen: a machine with other work is late now and then
_PATIENCE = WINDOW + 4.0  # s, chosen: for damping without complaint in a graph that has seen faults
_CODES = (0, 1, 130)  # of `drive`: nothing wrong, something wrong, interrupted

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
    with ending_signals(_interrupt_once()), ros_context(place.domain) as context:
        session = _Session(place, context)
        try:
            for number, case in enumerate(_in_order(cases)):
                progress(number / len(cases), case.name)
                outcomes[case.name] = session.outcome(case)
                tell(case, outcomes[case.name])
        finally:
            session.end_graph()
    return {case.name: outcomes[case.name] for case in cases}


def _interrupt_once() -> Callable[[], None]:
    """Return a function whose first call raises `KeyboardInterrupt`: a second signal cuts no end short."""
    came: list[bool] = []

    def interrupt() -> None:
        came.append(True)
        if len(came) == 1:
            raise KeyboardInterrupt

    return interrupt


def _in_order(cases: Sequence[FaultCase]) -> list[FaultCase]:
    """Return the faults so that those of one graph follow each other, and first those that it outlives."""
    return sorted(cases, key=lambda case: (_kind(case), case.ends_drive or case.for_good))


def _kind(case: FaultCase) -> Kind:
    return case.shim, case.options


@dataclass
class _Running:
    """A graph, its observers, and the faults that it has seen with their times on the system clock, s."""

    kind: Kind
    graph: GraphUnderTest
    observing: ExitStack
    tried: list[tuple[FaultCase, Outcome, float, float]] = field(default_factory=list)


class _Session:
    """The graph that runs at present, if one does."""

    def __init__(self, place: Place, context: Context):
        self._place = place
        self._context = context
        self._numbers = itertools.count(1)
        self._running: _Running | None = None

    def outcome(self, case: FaultCase) -> Outcome:
        """Try a fault; once more, if it was not as required."""
        outcome = self._trial(case)
        for _ in range(1, _TRIALS):
            if outcome.ok:
                break
            later = self._trial(case)
            if outcome.seen and not later.seen:
                outcome.earlier.append(later.wrong)
            else:
                later.earlier = [*outcome.earlier, outcome.wrong]
                outcome = later
        return outcome

    def _trial(self, case: FaultCase) -> Outcome:
        begin = time.time()
        try:
            running = self._prepared(case)
            begin = time.time()
            outcome = tried(case, running.graph)
        except (GraphUnderTestError, NonsenseTakenError) as error:
            outcome = Outcome(complaints=[str(error)])
            if self._running is None:
                return outcome
            running = self._running
        running.tried.append((case, outcome, begin, time.time()))
        if running.graph.ended:
            self.end_graph()
        return outcome

    def _prepared(self, case: FaultCase) -> _Running:
        """Return a graph that damps without complaint, or that starts where the fault is one of the start."""
        running = self._running
        if running is not None:
            try:
                if running.kind == _kind(case):
                    running.graph.wait_for_damping(partial(tells, case), _PATIENCE)
                    return running
            except GraphUnderTestError:
                pass  # what came before has spoiled it
            self.end_graph()
        running = self._running = self._started(case)
        if case.reaction is not Reaction.NOT_STARTED:
            running.graph.wait_for_damping(partial(tells, case))
        return running

    def _started(self, case: FaultCase) -> _Running:
        namespace = f'faults_{os.getpid()}_{next(self._numbers)}'
        stack = ExitStack()
        port = can_port(self._place.domain, namespace)
        observed = stack.enter_context(observers(self._context, namespace, port))
        operator = Node(
            'operator', namespace=namespace, context=self._context, start_parameter_services=False
        )
        stack.callback(operator.destroy_node)
        environment = shim_environment(self._place.folder) if case.shim else {}
        graph = GraphUnderTest(self._place, namespace, case.options, environment, observed, operator)
        return _Running(_kind(case), graph, stack)

    def end_graph(self) -> None:
        """End the graph that runs, and tell the faults that it has seen what its end has shown."""
        running, self._running = self._running, None
        if running is None:
            return
        with running.observing:
            ending = running.graph.end()
        if running.tried:
            _, last, _, _ = running.tried[-1]
            last.complaints += _complaints(ending)
        for case, outcome, begin, end in running.tried:
            if not case.loses_samples:
                outcome.complaints += lost_while(running.graph.folder, begin, end)


def _complaints(ending: Ending) -> list[str]:
    said = [f'left behind: {thing}' for thing in ending.left_behind]
    said += [f'traceback in {file}' for file in ending.tracebacks]
    if ending.code not in (*_CODES, -9):
        said.append(f'the command ended with code {ending.code}')
    return said
