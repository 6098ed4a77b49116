"""A lifecycle node that fails closed: every error ends in the safe state, with a sentence that says why."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.nodes.aside import run_in_thread
from mount_ros.nodes.diagnostics import (
    ActiveFindings,
    Diagnostics,
    Finding,
    Level,
    SlidingWindow,
    Verdict,
    verdict_on,
)
from mount_ros.nodes.parameters import Change, DeclaringNode, ParameterGate, refuse_sim_time, refuse_unknown
from mount_ros.nodes.real_time import LoopTiming, RealTime, RealTimeThreads
from mount_ros.publishers import PublisherWatch

_LOCKSTEP = (
    'lockstep',
    False,
    ParameterDescriptor(
        description='time stands in the stamps alone: each sample waits for its answer; one value in the '
        'whole graph'
    ),
)


class ServedPath(Protocol):
    """What carries the data of a node, as far as the lifecycle needs to know it."""

    refused: int
    refusal: str

    @property
    def name(self) -> str:
        """The full name of the node that has the topics."""

    @property
    def failure(self) -> str:
        """Why its thread has ended by itself; empty while it serves."""

    def unmatched(self) -> list[str]:
        """Return the names of the topics whose other side has not been found yet."""

    def stop(self) -> None:
        """End serving; safe to call twice."""


class SafeLifecycleNode(DeclaringNode):
    """Base of all nodes of the graph.

    A node overrides `configure`, `activate`, `deactivate`, `cleanup` and `judge`; it raises an
    exception with a clear sentence where a step cannot be done. `deactivate` must leave the coil at
    0 A and is called on every way out of the active state.

    Once it is configured its parameters stand still, except those in `run_time_parameters`.
    """

    run_time_parameters: frozenset[str] = frozenset()
    """Names of the parameters that can be set on the configured node: `check_parameters`, `apply_changes`."""

    real_time_threads = RealTimeThreads(frozenset({'data'}))
    """Its threads that work in real time while it is active."""

    def __init__(self, name: str, **arguments):
        super().__init__(name, **arguments)
        self._registered_name = name  # its own one may have been remapped
        self._gate = ParameterGate(self, self.run_time_parameters, self.check_parameters, self.apply_changes)
        self._lockstep = bool(self.declare_parameter(*_LOCKSTEP).value)
        self.data_path: ServedPath | None = None
        self._publisher_watch: PublisherWatch | None = None  # of what the data path hears
        self.data_thread: DataThread | None = None  # shared with the other nodes of the process, if any
        self.real_time = RealTime(0)  # that of the process, if it has one
        self.after_configure: Callable[[], None] = _nothing  # what a process wants done then
        self.after_failure: Callable[[], None] = _nothing  # and when a thread of the node has ended by itself
        self.ending = threading.Event()  # set when the process is told to end: long work must look at it
        self._active = False
        self._refusal = ''
        self._standing = ActiveFindings()
        self._path_errors = SlidingWindow(0)
        self._diagnostics = Diagnostics(self, self._look_and_judge)
        self._diagnostics.start()

    # What a node fills in.

    def configure(self) -> None:
        """Read and check the parameters, create what needs them."""

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """Stop working and leave 0 A behind."""

    def cleanup(self) -> None:
        """Release what `configure` made."""

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        """Raise a `ValueError` if the configured node could not go on with these values, {name: value}."""

    def apply_changes(self, changes: Mapping[str, Change]) -> None:
        """Go on with the parameters as they are now; `changes` were set while the node was configured."""

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        """Stay at 0 A: for good if `foreign` says that another node publishes, while `doubt` says it may.

        Both are sentences, empty where there is nothing to say. Called when they change, in any thread.
        """

    def judge(self) -> Verdict:
        """Return the verdict on the active node; must be quick and must not block."""
        return Verdict(Level.OK, 'active')

    def loop_timing(self) -> LoopTiming:
        """Return how a loop with a clock of its own has kept its time since the activation."""
        return LoopTiming()

    # State.

    @property
    def sentence(self) -> str:
        """What the node says of itself now."""
        return self._present_verdict().sentence

    @property
    def active(self) -> bool:
        """Whether the node is in its active state."""
        return self._active

    @property
    def lockstep(self) -> bool:
        """Whether time stands in the stamps alone; as it was when the node was configured."""
        return self._lockstep

    def open_data_path(self) -> DataPath:
        """Create the data path of this node; the node starts it when all subscriptions stand."""
        thread = self.data_thread or DataThread(self.context, self.report_failure)
        path = DataPath(
            self,
            lockstep=self.lockstep,
            thread=thread,
            on_conflict=self.on_publisher_conflict,
            name=self._registered_name,
        )
        self.data_path, self._publisher_watch = path, path.publisher_watch
        return path

    def report_publisher_conflict(self) -> None:
        """Call `on_publisher_conflict` with what holds now: for a node that has begun to heed it."""
        if self._publisher_watch is not None:
            self._publisher_watch.deliver()

    def wait_for_sole_publishers(self) -> None:
        """Return when topics have their own writers alone, or raise `PublisherConflictError`."""
        if self._publisher_watch is not None:
            self._publisher_watch.wait_for_own(self.ending)

    def report_failure(self, sentence: str) -> None:
        """Say that a thread of the node has ended by itself; the process ends the node then."""
        self.get_logger().fatal(sentence)
        self.after_failure()

    def close(self) -> None:
        """Leave the active state and release everything; called once at the end of the process."""
        with self._diagnostics.pause:
            if self._active:
                self._leave_active()
            self._release()

    def destroy_node(self) -> None:
        self._diagnostics.stop()
        super().destroy_node()

    # Transitions.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._lockstep = bool(self.get_parameter('lockstep').value)
        outcome = self._attempt('configure', self._configure, undo=self._release)
        if outcome == TransitionCallbackReturn.SUCCESS:
            self._gate.close()
            path = self.data_path
            place = f'; its topics are those of the node {path.name}' if path is not None else ''
            self.get_logger().info(f'configured{place}')
        self.after_configure()
        return outcome

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        outcome = self._attempt('activate', self.activate, undo=self.deactivate)
        self._active = outcome == TransitionCallbackReturn.SUCCESS
        if self._active:
            self.real_time.begin(self)
            self.get_logger().info('active')
        else:
            self.real_time.end(self)  # where the activation itself took it
        return outcome

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._leave_active()
        self.get_logger().info('inactive')
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._release()
        self.get_logger().info('cleaned up')
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def serve_transition(self, answer: Callable[[], Any]) -> Any:
        # An activation may take seconds, and parameters and state shall be told meanwhile.
        assert self.executor is not None
        return run_in_thread(self.executor, answer, f'{self.get_name()} transition')

    def change_state(self, transition_id: int) -> TransitionCallbackReturn:
        # rclpy lets a transition that is not valid in the present state end the process with an
        # exception; a node that drives a coil answers "no" and goes on.
        try:
            with self._diagnostics.pause, self._gate.held():
                return super().change_state(transition_id)
        except Exception as error:
            self.get_logger().warning(f'transition {transition_id} refused: {error}')
            return TransitionCallbackReturn.FAILURE

    def _configure(self) -> None:
        refuse_unknown(self)
        refuse_sim_time(self)
        self._path_errors = SlidingWindow(0)
        self.configure()

    def _attempt(self, what, step, undo) -> TransitionCallbackReturn:
        try:
            step()
        except Exception as error:
            # The border of the node: whatever the reason, say it, be safe, stay alive.
            known = isinstance(error, (ValueError, OSError))
            self._refusal = str(error) if known else f'{type(error).__name__}: {error}'
            self.get_logger().error(f'{what} failed: {self._refusal}')
            self._diagnostics.publish(self._present_verdict())
            self._make_safe(undo)
            return TransitionCallbackReturn.FAILURE
        self._refusal = ''
        return TransitionCallbackReturn.SUCCESS

    def _leave_active(self) -> None:
        self._active = False
        self._make_safe(self.deactivate)
        self.real_time.end(self)

    def _release(self) -> None:
        self._gate.open()
        self._make_safe(self.cleanup)
        path, self.data_path, self._publisher_watch = self.data_path, None, None
        if path is not None:
            self._make_safe(path.stop)

    def _make_safe(self, step) -> None:
        try:
            step()
        except Exception as error:
            self.get_logger().error(f'{step.__name__} failed: {type(error).__name__}: {error}')

    def _look_and_judge(self) -> Verdict:
        watch = self._publisher_watch
        if watch is not None:
            watch.look()
        return self._present_verdict()

    def _present_verdict(self) -> Verdict:
        path, watch = self.data_path, self._publisher_watch
        verdict = self._verdict_without_path()
        errors = self._errors_of(path) if path is not None else []
        other = (watch.confirmed or watch.suspected) if watch is not None else ''
        if other and verdict.level is Level.OK:
            verdict = Verdict(Level.WARN, other, verdict.figures)
        if path is not None and path.failure:
            verdict = Verdict(Level.ERROR, path.failure, {**verdict.figures, 'fatal': True})
        elif errors and verdict.level is Level.OK:
            verdict = verdict_on(errors, '', verdict.figures)
        verdict = self._standing.keep(verdict)
        unmatched = ', '.join(path.unmatched()) if path is not None else 'not configured'
        if self.real_time.given_back:
            sentence = self.real_time.given_back
            worse = verdict.level is not Level.OK
            sentence = f'{verdict.sentence}; {sentence}' if worse else sentence
            verdict = Verdict(max(verdict.level, Level.WARN), sentence, verdict.figures)
        state = 'active' if self._active else 'inactive'
        figures = {
            **verdict.figures,
            'state': state,
            'unmatched': unmatched,
            'other_writer': other,
            'path_errors': path.refused if path is not None else 0,
            'data_node': path.name if path is not None else '',
            'real_time_priority': self.real_time.held,
            'memory_locked': self.real_time.memory_locked,
        }
        return Verdict(verdict.level, verdict.sentence, figures)

    def _errors_of(self, path: ServedPath) -> list[Finding]:
        """Return the finding of errors within the last seconds, if there were any."""
        errors = path.refused
        lately = errors - self._path_errors.earlier(time.monotonic(), errors)
        sentence = f'errors in the data path ({lately}, limit: none), the last: {path.refusal}'
        return [Finding(Level.WARN, 'path errors', sentence)] if lately else []

    def _verdict_without_path(self) -> Verdict:
        if self._refusal:
            return Verdict(Level.ERROR, self._refusal)
        if not self._active:
            return Verdict(Level.OK, 'inactive')
        return self.judge()


def _nothing() -> None:
    """No process of its own."""
