"""Records topics without a graph of its own: the recorder node alone, a line that tells, keys that mark."""

import os
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from engine_mount.drives.keyboard import MARK_KEYS, Keyboard
from engine_mount.recordings.screen import Screen
from mount_bringup.graph.shutdown import ending_signals
from mount_recorder.bag_writer import RecordingError
from mount_recorder.diagnosis import OnFull
from mount_recorder.folders import snapshot_folder
from mount_recorder.node import NAME, MountRecorder
from mount_recorder.parameters import RecorderParameters
from mount_ros.environment import loopback_refusal
from mount_ros.nodes.lifecycle import wake
from mount_ros.nodes.process import ros_context, transition
from mount_ros.topics import EVENT, TOPICS, topic

# Several may run beside a graph; by the order of names the graph's own recorder sets the automatic marks.
_FAMILY = f'{NAME}_lone'
_LINE_PERIOD = 0.2  # s, chosen
_RATE_SPAN = 1.0  # s, chosen: over which messages are counted for their rate
_SERVICE_PERIOD = 0.2  # s, chosen
_KEYS = 'm or space: mark, Ctrl-C: end'


@dataclass(frozen=True)
class RecordOrder:
    """What the user orders; no names of topics are all, `duration` in s, None without an end."""

    out: Path
    parameters: RecorderParameters
    topics: tuple[str, ...] = ()
    domain: int = 0
    namespace: str = ''
    duration: float | None = None


@dataclass(frozen=True)
class RecordOutcome:
    """What came of it: the recordings, messages that came and do not stand there, why it failed, if so."""

    folders: list[Path]
    lost: int
    failure: str


def record(order: RecordOrder, screen: Screen) -> RecordOutcome:
    """Record until Ctrl-C, SIGTERM or the end of the duration; raises a `ValueError` with the reason."""
    names = chosen_topics(order.topics)
    if refusal := loopback_refusal():
        raise RecordingError(refusal)
    asked: list[bool] = []  # to end, by a signal; no lock: a second one may come amid the first
    with ending_signals(lambda: asked.append(True)), ros_context(order.domain) as context:
        recorder = _LoneRecorder(order, names, context)
        try:
            recorder.begin()
            screen.say(f'recording {len(names)} topics')
            _watch(recorder, order, asked, screen)
        finally:
            outcome = recorder.end()
    return outcome


def chosen_topics(names: tuple[str, ...]) -> list[str]:
    """Return the registered names meant, all if there are none, with `event`, which holds the marks."""
    if not names:
        return [entry.name for entry in TOPICS]
    full = {entry.name.strip('/'): entry.name for entry in TOPICS}
    wanted = [full.get(name.strip('/'), name) for name in names]
    for name in wanted:
        try:
            topic(name)
        except KeyError as error:
            raise RecordingError(error.args[0]) from None
    return list(dict.fromkeys([*wanted, EVENT.name]))


class _LoneRecorder:
    """The recorder in this process, and the thread that serves its diagnostics and its service."""

    def __init__(self, order: RecordOrder, topics: list[str], context: Context):
        values = {'uri': str(order.out), 'topics': topics, **order.parameters._asdict()}
        self._order = order
        self._node = MountRecorder(
            f'{_FAMILY}_{os.getpid()}',
            context=context,
            namespace=order.namespace,
            parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
        )
        self._node.get_logger().set_level(LoggingSeverity.FATAL)  # this command speaks for it
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=NAME, daemon=True)

    def begin(self) -> None:
        """Record from now on."""
        transition(self._node.trigger_configure, self._node, NAME)
        transition(self._node.trigger_activate, self._node, NAME)
        self._thread.start()

    def figures(self) -> Mapping[str, object]:
        """Return the figures of the recorder, and the `sentence` about them."""
        verdict = self._node.judge()
        return {**verdict.figures, 'sentence': verdict.sentence}

    def mark(self) -> None:
        """Mark this moment."""
        self._node.mark()

    def end(self) -> RecordOutcome:
        """Close the recording and the node."""
        begun = self._thread.is_alive()
        self._ending.set()
        if begun:
            wake(self._executor)
            self._thread.join()
        self._executor.shutdown()
        if begun:
            self._node.trigger_deactivate()
        figures = self.figures() if begun else {}
        self._node.close()
        self._node.destroy_node()
        return self._outcome(figures)

    def _serve(self) -> None:
        while not self._ending.is_set():
            self._executor.spin_once(_SERVICE_PERIOD)

    def _outcome(self, figures: Mapping[str, object]) -> RecordOutcome:
        first = self._order.out
        snapshots = range(1, _number(figures, 'snapshots') + 1)
        whole = [first] if figures else []
        folders = [snapshot_folder(first, n) for n in snapshots] if self._order.parameters.snapshot else whole
        failure = str(figures['sentence']) if figures.get('failed') else ''
        return RecordOutcome(folders, _number(figures, 'lost'), failure)


def _watch(recorder: _LoneRecorder, order: RecordOrder, asked: list[bool], screen: Screen) -> None:
    begin = time.monotonic()
    end = begin + order.duration if order.duration is not None else float('inf')
    line = _Line(begin)
    stopping = order.parameters.on_full == OnFull.STOP.value
    with Keyboard() as keyboard, screen.line('') as show:
        hint = f'  ({_KEYS})' if keyboard.present else ''
        while not asked and (now := time.monotonic()) < end:
            figures = recorder.figures()
            if figures['failed'] and stopping:
                return
            show(line.text(figures, now) + hint)
            for key in keyboard.wait(min(_LINE_PERIOD, end - now)):
                if key in MARK_KEYS:
                    recorder.mark()


class _Line:
    """The figures of this moment in one line."""

    def __init__(self, begin: float):
        self._begin = begin
        self._counts = deque([(begin, 0)])

    def text(self, figures: Mapping[str, object], now: float) -> str:
        """Return the line at the time `now` (s, steady clock)."""
        counts = self._counts
        counts.append((now, _number(figures, 'received')))
        while len(counts) > 2 and counts[1][0] <= now - _RATE_SPAN:
            counts.popleft()
        span = max(counts[-1][0] - counts[0][0], 1e-3)
        rate = (counts[-1][1] - counts[0][1]) / span
        marks = _number(figures, 'events')
        parts = [
            f'{now - self._begin:.0f} s',
            f'{rate:.0f} messages/s',
            f'{_number(figures, "file_bytes") / 1e6:.1f} MB',
            f'{_number(figures, "lost")} lost',
            f'{marks} mark{"" if marks == 1 else "s"}',
        ]
        if 'snapshots' in figures:
            parts.append(f'{_number(figures, "snapshots")} saved, {figures["held_s"]} s in memory')
        if figures['failed']:
            parts.append('not recording any more')
        return '   '.join(parts)


def _number(figures: Mapping[str, object], name: str) -> int:
    value = figures.get(name, 0)
    assert isinstance(value, int)
    return value
