"""The key that sets a mark, read from a terminal that is left as it was found."""

import contextlib
import os
import select
import sys
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from engine_mount.recordings.screen import Screen
from mount_bringup.graph.nodes import GraphError
from mount_bringup.graph.shutdown import ending_signals
from mount_recorder.bag_writer import RecordingError
from mount_recorder.diagnosis import OnFull
from mount_recorder.node import NAME, MountRecorder
from mount_recorder.parameters import RecorderParameters
from mount_ros.environment import loopback_refusal
from mount_ros.nodes.process import ros_context, transition
from mount_ros.topics import EVENT, SHADOW_TOPICS, TOPICS, topic

_MARKS = b'm '


@contextlib.contextmanager
def mark_keys() -> Iterator[Callable[[float], int] | None]:
    """Give a function that waits up to so many s and returns how often `m` or space was pressed.

    None without a terminal in whose foreground this process is. To be used within `ending_signals`: a signal
    that ended the process at once would leave the terminal without echo.
    """
    stream = sys.stdin
    if not (stream and not stream.closed and stream.isatty() and _in_foreground(stream.fileno())):
        yield None
        return

    def pressed(duration: float) -> int:
        if not select.select([stream], [], [], duration)[0]:
            return 0
        return sum(key in _MARKS for key in os.read(stream.fileno(), 64))

    saved = termios.tcgetattr(stream)
    tty.setcbreak(stream)
    try:
        yield pressed
    finally:
        termios.tcsetattr(stream, termios.TCSADRAIN, saved)


def _in_foreground(terminal: int) -> bool:
    """Return whether the terminal's settings may be changed: a process in the background would be stopped."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the terminal that controls this process, so it cannot stop it
        return True


# Several may run beside a graph.
_FAMILY = f'{NAME}_lone'
_LINE_PERIOD = 0.5  # s, chosen: over it messages are counted for their rate
_SERVICE_PERIOD = 0.2  # s, chosen


@dataclass(frozen=True)
class Recorded:
    """Messages that were received and are not in the recording, and why it failed, if so."""

    lost: int
    failure: str


def record(
    out: Path,
    parameters: RecorderParameters,
    screen: Screen,
    *,
    topics: Sequence[str] = (),
    duration: float | None = None,
    domain: int = 0,
    namespace: str = '',
) -> Recorded:
    """Record `topics` (none named: all) until Ctrl-C, SIGTERM or `duration` (s).

    Raises a `ValueError`, or `GraphError` where no graph can be reached.
    """
    names = chosen_topics(topics)
    if refusal := loopback_refusal():
        raise GraphError(refusal)
    values = {'uri': str(out), 'topics': names, **parameters._asdict()}
    signals: list[bool] = []  # that end the recording; no lock: a second one may come amid the first
    with ending_signals(lambda: signals.append(True)), ros_context(domain) as context:
        node = MountRecorder(
            f'{_FAMILY}_{os.getpid()}',
            context=context,
            namespace=namespace,
            parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
        )
        node.get_logger().set_level(LoggingSeverity.FATAL)  # this command speaks for it
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        ending = threading.Event()

        def serve() -> None:
            while not ending.is_set():
                executor.spin_once(_SERVICE_PERIOD)

        thread = threading.Thread(target=serve, name=NAME, daemon=True)
        figures: dict[str, Any] = {}
        try:
            transition(node.trigger_configure, node, NAME)
            transition(node.trigger_activate, node, NAME)
            thread.start()
            screen.say(f'recording {len(names)} topics')
            _watch(node, signals, duration, screen, until_failure=parameters.on_full == OnFull.STOP.value)
        finally:
            if thread.is_alive():
                ending.set()
                executor.wake()
                thread.join()
                node.trigger_deactivate()
                figures = _figures(node)
            executor.shutdown()
            node.close()
            node.destroy_node()
    failure = str(figures['sentence']) if figures.get('failed') else ''
    return Recorded(figures.get('lost', 0), failure)


def chosen_topics(names: Sequence[str]) -> list[str]:
    """Return the registered names, all if none are given, with `event`, which holds the marks."""
    full = {entry.name.strip('/'): entry.name for entry in TOPICS + SHADOW_TOPICS}
    if not names:
        return list(full.values())
    wanted = [full.get(name.strip('/'), name) for name in names]
    for name in wanted:
        try:
            topic(name)
        except KeyError as error:
            raise RecordingError(error.args[0]) from None
    return list(dict.fromkeys([*wanted, EVENT.name]))


def _figures(node: MountRecorder) -> dict[str, Any]:
    verdict = node.judge()
    return {**verdict.figures, 'sentence': verdict.sentence}


def _watch(
    node: MountRecorder, signals: list[bool], duration: float | None, screen: Screen, *, until_failure: bool
) -> None:
    """Show the figures and set marks until the end."""
    begin = time.monotonic()
    end = begin + duration if duration is not None else float('inf')
    before, counted = begin, 0  # s on the clock, messages received
    with mark_keys() as pressed, screen.line('') as show:
        hint = '  (m or space: mark, Ctrl-C: end)' if pressed is not None else ''
        while not signals and (now := time.monotonic()) < end:
            figures = _figures(node)
            if figures['failed'] and until_failure:
                return
            received = figures.get('received', 0)
            rate = (received - counted) / max(now - before, 1e-3)
            before, counted = now, received
            show(_line(figures, now - begin, rate) + hint)
            wait = min(_LINE_PERIOD, end - now)
            if pressed is None:
                time.sleep(wait)
                continue
            for _ in range(pressed(wait)):
                node.mark()


def _line(figures: Mapping[str, Any], elapsed: float, rate: float) -> str:
    """Return the figures of this moment in one line; `elapsed` in s, `rate` in messages/s."""
    marks = figures.get('events', 0)
    parts = [
        f'{elapsed:.0f} s',
        f'{rate:.0f} messages/s',
        f'{figures.get("file_bytes", 0) / 1e6:.1f} MB',
        f'{figures.get("lost", 0)} lost',
        f'{marks} mark{"" if marks == 1 else "s"}',
    ]
    if figures['failed']:
        parts.append('not recording any more')
    return '   '.join(parts)
