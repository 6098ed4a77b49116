"""A lifecycle node that fails closed: every error ends in the safe state, with a sentence that says why."""

import threading
import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.messages.verdicts import Level
from mount_ros.nodes.diagnostics import (
    ActiveFindings,
    Diagnostics,
    Finding,
    SlidingWindow,
    Verdict,
    verdict_on,
)
from mount_ros.nodes.parameters import ParameterNode
from mount_ros.nodes.real_time import RealTime, RealTimeThreads
from mount_ros.publishers import PublisherWatch

_LOCKSTEP = 'time stands in the stamps alone: each sample waits for its answer; one value in the whole graph'
_SUCCESS, _FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class SafeLifecycleNode(ParameterNode):
    """Base of all nodes of the graph.

    A node overrides `configure`, `activate`, `deactivate`, `cleanup` and `judge`; it raises an
    exception with a clear sentence where a step cannot be done. `deactivate` must leave the coil at
    0 A and is called on every way out of the active state.

    Once it is configured its parameters stand still, except those in `run_time_parameters`.
    """

    real_time_threads = RealTimeThreads(frozenset({'data'}))
    """Its threads that work in real time while it is active."""

    def __init__(self, name: str, **arguments):
        super().__init__(name, **arguments)
        self._registered_name = name  # its own one may have been remapped
        descriptor = ParameterDescriptor(description=_LOCKSTEP)
        self.lockstep = bool(self.declare_parameter('lockstep', False, descriptor).value)
        """Whether time stands in the stamps alone; as it was when the node was configured."""
        self.data_path: Any = None
        """What carries its data, and ends with the node: a `DataPath`, or what has the same figures."""
        self._publisher_watch: PublisherWatch | None = None  # of the topics of the data path
        self.data_thread: DataThread | None = None  # shared with the other nodes of the process, if any
        self.real_time = RealTime(0)  # that of the process, if it has one
        self.after_configure: Callable[[], None] = _nothing  # what a process does then
        self.after_failure: Callable[[], None] = _nothing  # and when a thread of the node has ended by itself
        self.ending = threading.Event()  # set when the process shall end: long work must check it
        self.active = False
        """Whether the node is in its active state."""
        self._refusal = ''
        self._findings = ActiveFindings()
        self._path_errors = SlidingWindow(0)
        self._diagnostics = Diagnostics(self, self._check_and_judge)
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

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        """Stay at 0 A: for good if another node is `confirmed` to publish, and while one is `suspected`.

        Both are sentences, empty where there is none. Called when they change, in any thread.
        """

    def judge(self) -> Verdict:
        """Return the verdict on the active node; must be quick and must not block."""
        return Verdict(Level.OK, 'active')

    # State.

    @property
    def sentence(self) -> str:
        """The sentence of the present verdict."""
        return self._present_verdict().sentence

    def open_data_path(self) -> DataPath:
        """Create the data path of this node; the node starts it when all subscriptions stand."""
        path = DataPath(
            self,
            lockstep=self.lockstep,
            thread=self.data_thread,
            on_conflict=self.on_publisher_conflict,
            on_failure=self.report_failure,
            name=self._registered_name,
        )
        self.data_path, self._publisher_watch = path, path.publisher_watch
        return path

    def report_failure(self, sentence: str) -> None:
        """Report that a thread of the node has ended by itself; the process ends the node then."""
        self.get_logger().fatal(sentence)
        self.after_failure()

    def close(self) -> None:
        """Leave the active state and release everything; called once at the end of the process."""
        with self._diagnostics.pause:
            if self.active:
                self._leave_active()
            self._release()

    def destroy_node(self) -> None:
        self._diagnostics.stop()
        super().destroy_node()

    # Transitions.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.lockstep = bool(self.get_parameter('lockstep').value)
        self._path_errors = SlidingWindow(0)
        outcome = self._attempt('configure', self.refuse_given, self.configure, undo=self._release)
        if outcome == _SUCCESS:
            self.fix_parameters()
            place = f'; its topics are those of the node {self.data_path.name}' if self.data_path else ''
            self.get_logger().info(f'configured{place}')
        self.after_configure()
        return outcome

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        outcome = self._attempt('activate', self.activate, undo=self.deactivate)
        self.active = outcome == _SUCCESS
        if self.active:
            self.real_time.begin(self)
            self.get_logger().info('active')
        else:
            self.real_time.end(self)  # where the activation itself took it
        return outcome

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._leave_active()
        self.get_logger().info('inactive')
        return _SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._release()
        self.get_logger().info('cleaned up')
        return _SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.close()
        return _SUCCESS

    on_error = on_shutdown

    def change_state(self, transition_id: int) -> TransitionCallbackReturn:
        # rclpy lets a transition that is not valid in the present state end the process with an
        # exception; a node that drives a coil answers "no" and goes on.
        try:
            with self._diagnostics.pause:
                return super().change_state(transition_id)
        except Exception as error:
            self.get_logger().warning(f'transition {transition_id} refused: {error}')
            return _FAILURE

    def _attempt(
        self, what: str, *steps: Callable[[], None], undo: Callable[[], None]
    ) -> TransitionCallbackReturn:
        try:
            for step in steps:
                step()
        except Exception as error:
            # The border of the node: whatever the reason, say it, be safe, stay alive.
            known = isinstance(error, ValueError | OSError)
            self._refusal = str(error) if known else f'{type(error).__name__}: {error}'
            self.get_logger().error(f'{what} failed: {self._refusal}')
            self._diagnostics.publish(self._present_verdict())
            self._make_safe(undo)
            return _FAILURE
        self._refusal = ''
        return _SUCCESS

    def _leave_active(self) -> None:
        self.active = False
        self._make_safe(self.deactivate)
        self.real_time.end(self)

    def _release(self) -> None:
        self.free_parameters()
        self._make_safe(self.cleanup)
        path, self.data_path, self._publisher_watch = self.data_path, None, None
        if path is not None:
            self._make_safe(path.stop)

    def _make_safe(self, step: Callable[[], None]) -> None:
        try:
            step()
        except Exception as error:
            self.get_logger().error(f'{step.__name__} failed: {type(error).__name__}: {error}')

    # The verdict.

    def _check_and_judge(self) -> Verdict:
        if self._publisher_watch is not None:
            self._publisher_watch.check()
        return self._present_verdict()

    def _present_verdict(self) -> Verdict:
        path, watch, real_time = self.data_path, self._publisher_watch, self.real_time
        other = (watch.confirmed or watch.suspected) if watch is not None else ''
        if self._refusal:
            verdict = Verdict(Level.ERROR, self._refusal)
        else:
            verdict = self.judge() if self.active else Verdict(Level.OK, 'inactive')
        figures = {
            **verdict.figures,
            'state': 'active' if self.active else 'inactive',
            'other_writer': other,
            'path_errors': 0 if path is None else path.refused,
            'data_node': '' if path is None else path.name,
            'unmatched': 'not configured' if path is None else ', '.join(path.unmatched()),
            'real_time_priority': real_time.held,
            'memory_locked': real_time.memory_locked,
        }
        if other and verdict.level is Level.OK:
            verdict = Verdict(Level.WARN, other)
        if path is not None:
            lately = path.refused - self._path_errors.earlier(time.monotonic(), path.refused)
            if path.failure:
                verdict = Verdict(Level.ERROR, path.failure)
                figures['fatal'] = True
            elif lately and verdict.level is Level.OK:
                text = f'errors in the data path ({lately}, limit: none), the last: {path.refusal}'
                verdict = verdict_on([Finding(Level.WARN, 'path errors', text)], '', {})
        verdict = self._findings.keep(verdict)
        level, sentence = verdict.level, verdict.sentence
        if reason := real_time.given_back:
            sentence = reason if level is Level.OK else f'{sentence}; {reason}'
            level = max(level, Level.WARN)
        return Verdict(level, sentence, figures)


def _nothing() -> None:
    """No process of its own."""
