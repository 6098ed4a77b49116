"""Replay through the real nodes over topics: each sample is sent when the one before it was answered.

Player and nodes share this process and one data thread, in a namespace of their own, so that a graph which
runs in the same domain neither receives nor disturbs them. A sample that is not answered ends the replay.
"""

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeVar

import numpy as np
from rclpy.context import Context
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.parameter import Parameter

from engine_mount.drives.core import OFF, ControlAnswers, Progress, RampAnswers, Replayed, activation_before
from engine_mount.drives.inputs.input import Column, ControlRun, ReplayError, ReplayInput, Times
from engine_mount.drives.inputs.ramps import MeasuredGap, Ramp
from engine_mount.settings.chosen import Parameters
from mount_control.node import MountControl
from mount_init.node import MountInit
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.messages.cdr import temperature
from mount_ros.messages.force_table import from_bytes, table_message
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout, stamp_of
from mount_ros.nodes.diagnostics import Level
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.process import ros_context, transition

PATIENCE = 10.0  # s, chosen: a node that answers later does not answer
_LOOK_PERIOD = 0.1  # s

Send = Callable[[bytes], None]
N = TypeVar('N', bound=SafeLifecycleNode)


def replay_in_lockstep(
    given: ReplayInput, parameters: Parameters, domain: int, progress: Progress = lambda share: None
) -> Replayed:
    """Replay all parts through mount_init and mount_control; raises a `ValueError` where one refuses."""
    replayed = Replayed()
    total = sum(len(part.stamps) for part in given.parts)
    done = 0
    with ros_context(domain) as context:
        player = _Player(context, parameters)
        begin = time.perf_counter()
        for part in given.parts:
            part_begin = time.perf_counter()
            player.play(part, replayed, partial(_report, progress, done, total))
            if isinstance(part, ControlRun):
                replayed.control_time += time.perf_counter() - part_begin
            done += len(part.stamps)
        replayed.wall_time = time.perf_counter() - begin
    return replayed


def _report(progress: Progress, done: int, total: int, samples: int) -> None:
    progress((done + samples) / total)


class _Player:
    """The other side of the topics, where driver and initialisation stand in the graph."""

    def __init__(self, context: Context, parameters: Parameters):
        self._context = context
        self._parameters = parameters
        self._namespace = f'/replay_{os.getpid()}'
        self._thread = DataThread(context)
        self._result: MeasuredGap | None = None

    def play(self, part: Ramp | ControlRun, replayed: Replayed, progress: Callable[[int], None]) -> None:
        """Replay one ramp or run through a node of its own, and append its answers."""
        if isinstance(part, Ramp):
            answers = self._ramp(part, progress)
            self._result = answers.gap
            replayed.parts.append(answers)
            return
        result = self._result
        gap = result if result is not None and result.stamp == part.gap.stamp else part.gap
        replayed.parts.append(self._run(part, gap, progress))
        replayed.gaps.append(gap)

    def _ramp(self, ramp: Ramp, progress: Callable[[int], None]) -> RampAnswers:
        layout = ScalarsLayout(topics.COIL_RIPPLE)
        messages = [
            layout.pack(stamp, (current, np.nan), (current_rate, flux_rate))
            for stamp, current, current_rate, flux_rate in ramp.samples()
        ]
        own = {'silence_timeout': PATIENCE}
        with self._node(MountInit, 'mount_init', own) as node, self._path(node) as path:
            send = _with_temperatures(
                path.sender(topics.COIL_RIPPLE), path.sender(topics.COIL_TEMPERATURE), ramp
            )
            dialogue = _Dialogue(send, ramp.stamps, messages)
            results: dict[str, bytes] = {}
            path.subscribe(topics.CURRENT_SETPOINT, dialogue.take_setpoint)
            path.subscribe(topics.AIR_GAP, lambda raw: results.update(gap=raw))
            path.subscribe(topics.CURRENT_FORCE_TABLE, lambda raw: results.update(table=raw))
            path.start()
            _match(path, node)
            dialogue.begin()
            transition(node.trigger_activate, node, 'mount_init')
            dialogue.wait(progress, 'mount_init')
            _wait_for(lambda: len(results) == 2, 'air_gap and current_force_table')
            stamp, numbers, _ = ScalarsLayout(topics.AIR_GAP).unpack(results['gap'])
            gap = MeasuredGap(
                stamp, dict(zip(topics.AIR_GAP.names, numbers, strict=True)), from_bytes(results['table'])
            )
            return RampAnswers(ramp.stamps, dialogue.setpoints(), gap)

    def _run(self, run: ControlRun, gap: MeasuredGap, progress: Callable[[int], None]) -> ControlAnswers:
        layout = ScalarsLayout(topics.DISPLACEMENT)
        pairs = zip(run.stamps.tolist(), run.displacement.tolist(), strict=True)
        messages = [layout.pack(stamp, (value,)) for stamp, value in pairs]
        with self._node(MountControl, 'mount_control', {}) as node, self._path(node) as path:
            send = path.sender(topics.DISPLACEMENT)
            dialogue = _Dialogue(send, run.stamps, messages)
            path.subscribe(topics.CURRENT_SETPOINT, dialogue.take_setpoint)
            path.subscribe(topics.CONTROL_TRACE, dialogue.take_trace)
            stamp = activation_before(int(run.stamps[0]))
            gap_layout = ScalarsLayout(topics.AIR_GAP)
            table = np.stack([gap.table.current, gap.table.normal_force])
            send_gap, send_table = path.sender(topics.AIR_GAP), path.sender(topics.CURRENT_FORCE_TABLE)
            path.start()
            _match(path, node)
            send_gap(gap_layout.pack(stamp, [gap.numbers[name] for name in gap_layout.names]))
            send_table(table_message(stamp, table))
            send(layout.pack(stamp, (float(run.displacement[0]),)))
            transition(node.trigger_activate, node, 'mount_control')
            dialogue.begin()
            dialogue.wait(progress, 'mount_control')
            answers = _control_answers(run, dialogue, node)
            node.trigger_deactivate()
            if answers.setpoints[-1] != OFF:
                _wait_for(lambda: dialogue.repeated == 1, '0 A at the deactivation of mount_control')
            return answers

    @contextmanager
    def _node(self, kind: type[N], name: str, own: Mapping[str, Any]) -> Iterator[N]:
        values = {**self._parameters.get(name, {}), **own, 'lockstep': True}
        overrides = [Parameter(key, value=value) for key, value in values.items()]
        node = kind(context=self._context, namespace=self._namespace, parameter_overrides=overrides)
        node.data_thread = self._thread
        node.get_logger().set_level(LoggingSeverity.WARN)
        try:
            transition(node.trigger_configure, node, name)
            yield node
        finally:
            node.close()
            node.destroy_node()

    @contextmanager
    def _path(self, node: SafeLifecycleNode) -> Iterator[DataPath]:
        owner = Node(
            'mount_replay',
            context=self._context,
            namespace=self._namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )
        path = DataPath(owner, lockstep=True, thread=self._thread)
        try:
            yield path
        finally:
            path.stop()
            owner.destroy_node()


class _Dialogue:
    """Sends the next sample as soon as the one before is answered, on the data thread."""

    def __init__(self, send: Send, stamps: Times, messages: list[bytes]):
        self._send = send
        self._stamps: list[int] = stamps.tolist()
        self._messages = messages
        self._answers: list[bytes] = []
        self.traces: list[bytes] = []
        self.take_trace = self.traces.append
        self._sent = 0
        self._over = threading.Event()
        self.repeated = 0  # setpoints after the last answer: 0 A at the deactivation

    def begin(self) -> None:
        """Send the first sample."""
        self._sent = 1
        self._send(self._messages[0])

    def take_setpoint(self, raw: bytes) -> None:
        """Take the answer to the sample that waits for one, and send the next."""
        answered = len(self._answers)
        if answered == self._sent or stamp_of(raw) != self._stamps[answered]:
            self.repeated += self._over.is_set()
            return
        self._answers.append(raw)
        if self._sent < len(self._messages):
            self._sent += 1
            self._send(self._messages[self._sent - 1])
        else:
            self._over.set()

    def wait(self, progress: Callable[[int], None], name: str) -> None:
        """Return when every sample is answered; raise `ReplayError` when one is not for `PATIENCE` s."""
        answered, since = 0, time.monotonic()
        while not self._over.wait(_LOOK_PERIOD):
            if len(self._answers) != answered:
                answered, since = len(self._answers), time.monotonic()
                progress(answered)
            elif time.monotonic() - since > PATIENCE:
                raise ReplayError(
                    f'sample {answered} of {len(self._stamps)} ({self._stamps[answered] / 1e9:.3f} s) was '
                    f'not answered within {PATIENCE:g} s; {name} does not answer'
                )

    def setpoints(self) -> Column:
        """Return the setpoints (A) of all samples."""
        unpack = ScalarsLayout(topics.CURRENT_SETPOINT).unpack
        return np.array([unpack(raw)[1][0] for raw in self._answers])


def _with_temperatures(send_ripple: Send, send_temperature: Send, ramp: Ramp) -> Send:
    """Return what sends a ripple sample and behind it the temperatures that had come by its time.

    Those from before the ramp go with its first sample, the newest of them only: a subscription keeps few.
    """
    layout = OneNumberLayout(temperature)
    first = int(ramp.stamps[0])
    earlier = [entry for entry in ramp.temperatures if entry[0] <= first]
    due = deque([*earlier[-1:], *(entry for entry in ramp.temperatures if entry[0] > first)])

    def send(raw: bytes) -> None:
        send_ripple(raw)
        while due and due[0][0] <= stamp_of(raw):
            send_temperature(layout.pack(*due.popleft()))

    return send


def _control_answers(run: ControlRun, dialogue: _Dialogue, node: MountControl) -> ControlAnswers:
    verdict = node.judge()
    counts = node.loop.counts
    _wait_for(lambda: len(dialogue.traces) >= counts.samples, 'the last control_trace')
    answers = ControlAnswers(
        run.stamps,
        dialogue.setpoints(),
        np.zeros(len(run.stamps), bool),
        np.zeros(len(run.stamps), node.loop.trace_type),
        counts,
        verdict.sentence if verdict.level is Level.ERROR else '',
    )
    unpack = ScalarsLayout(node.trace_topic).unpack
    for raw in dialogue.traces:
        stamp, numbers, _ = unpack(raw)
        place = int(np.searchsorted(run.stamps, stamp))
        answers.traced[place] = True
        answers.traces[place] = numbers
    return answers


def _match(path: DataPath, node: SafeLifecycleNode) -> None:
    assert node.data_path is not None
    ends = (path, node.data_path)
    _wait_for(lambda: not any(end.unmatched() for end in ends), 'connection of all topics')


def _wait_for(condition: Callable[[], bool], what: str) -> None:
    limit = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > limit:
            raise ReplayError(f'{what} did not come within {PATIENCE:g} s')
        time.sleep(0.001)
