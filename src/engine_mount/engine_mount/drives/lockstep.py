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

from engine_mount.drives.core import (
    OFF,
    ControlAnswers,
    Progress,
    RampAnswers,
    Replayed,
    activation_before,
    replay_parts,
)
from engine_mount.drives.inputs.consumed_samples import (
    Column,
    ControlRun,
    MeasuredGap,
    Ramp,
    ReplayError,
    Times,
)
from engine_mount.drives.inputs.input import ReplayInput
from engine_mount.settings.chosen import Parameters
from mount_control.node import MountControl
from mount_init.node import MountInit
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.messages.cdr import temperature
from mount_ros.messages.force_table import from_bytes
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout, stamp_of
from mount_ros.nodes.diagnostics import Level
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.process import ros_context, transition
from mount_ros.topics import Topic

PATIENCE = 10.0  # s, chosen: a node that answers later does not answer
_LOOK_PERIOD = 0.1  # s

Send = Callable[[bytes], None]
N = TypeVar('N', bound=SafeLifecycleNode)


def replay_in_lockstep(
    given: ReplayInput, parameters: Parameters, domain: int, progress: Progress = lambda share: None
) -> Replayed:
    """Replay all parts through mount_init and mount_control; raises a `ValueError` where one refuses."""
    total = sum(len(part.stamps) for part in given.parts)
    done = 0

    def play(play_part: Callable[..., Any], part: Ramp | ControlRun, *gap: MeasuredGap) -> Any:
        nonlocal done
        answers = play_part(part, *gap, lambda samples: progress((done + samples) / total))
        done += len(part.stamps)
        return answers

    with ros_context(domain) as context:
        player = NodePlayer(context, parameters, f'/replay_{os.getpid()}')
        return replay_parts(given, partial(play, player.play_ramp), partial(play, player.play_run))


class NodePlayer:
    """The other side of the topics, where driver and initialisation stand in the graph."""

    def __init__(self, context: Context, parameters: Parameters, namespace: str, *, lockstep: bool = True):
        self._context, self._parameters, self._namespace = context, parameters, namespace
        self._lockstep = lockstep
        self._thread = DataThread(context)

    def play_ramp(self, ramp: Ramp, progress: Callable[[int], None]) -> RampAnswers:
        """Replay one initialisation through a node of its own."""
        layout = ScalarsLayout(topics.COIL_RIPPLE)
        messages = [
            layout.pack(stamp, (current, np.nan), (current_rate, flux_rate))
            for stamp, current, current_rate, flux_rate in ramp.samples()
        ]
        dialogue = _Dialogue(ramp.stamps, messages)
        results: dict[str, bytes] = {}
        receive = {
            topics.CURRENT_SETPOINT: dialogue.take_setpoint,
            topics.AIR_GAP: lambda raw: results.update(gap=raw),
            topics.CURRENT_FORCE_TABLE: lambda raw: results.update(table=raw),
        }
        sent = (topics.COIL_RIPPLE, topics.COIL_TEMPERATURE)
        with self._node(MountInit, 'mount_init', sent, receive) as (node, (ripple, temperature)):
            dialogue.begin(_with_temperatures(ripple, temperature, ramp))
            transition(node.trigger_activate, node, 'mount_init')
            dialogue.wait(progress, 'mount_init')
            _wait_for(lambda: len(results) == 2, 'air_gap and current_force_table')
        stamp, numbers, _ = ScalarsLayout(topics.AIR_GAP).unpack(results['gap'])
        named = dict(zip(topics.AIR_GAP.names, numbers, strict=True))
        gap = MeasuredGap(stamp, named, from_bytes(results['table']))
        return RampAnswers(ramp.stamps, dialogue.setpoints(), gap)

    def play_run(self, run: ControlRun, gap: MeasuredGap, progress: Callable[[int], None]) -> ControlAnswers:
        """Replay one run of the controller through a node of its own."""
        dialogue = _Dialogue(run.stamps, displacement_messages(run))
        receive = {
            topics.CURRENT_SETPOINT: dialogue.take_setpoint,
            topics.CONTROL_TRACE: dialogue.traces.append,
        }
        with self.active_control(run, gap, receive) as (node, send):
            dialogue.begin(send)
            dialogue.wait(progress, 'mount_control')
            answers = _control_answers(run, dialogue, node)
            node.trigger_deactivate()
            if answers.setpoints[-1] != OFF:
                _wait_for(lambda: dialogue.repeated == 1, '0 A at the deactivation of mount_control')
            return answers

    @contextmanager
    def active_control(
        self, run: ControlRun, gap: MeasuredGap, receive: Mapping[Topic, Send]
    ) -> Iterator[tuple[MountControl, Send]]:
        """Give mount_control, active with `gap` before the first sample of `run`, and what sends samples."""
        sent = (topics.DISPLACEMENT, topics.AIR_GAP, topics.CURRENT_FORCE_TABLE)
        with self._node(MountControl, 'mount_control', sent, receive) as (node, senders):
            send, send_gap, send_table = senders
            stamp = activation_before(int(run.stamps[0]))
            for send_part, raw in zip((send_gap, send_table), gap.dated(stamp).messages(), strict=True):
                send_part(raw)
            send(ScalarsLayout(topics.DISPLACEMENT).pack(stamp, (float(run.displacement[0]),)))
            transition(node.trigger_activate, node, 'mount_control')
            yield node, send

    @contextmanager
    def _node(
        self, kind: type[N], name: str, sent: tuple[Topic, ...], receive: Mapping[Topic, Send]
    ) -> Iterator[tuple[N, list[Send]]]:
        """Give a configured node and the senders of the topics `sent`; `receive` takes what it publishes."""
        own = {'silence_timeout': PATIENCE} if kind is MountInit else {}
        values = {**self._parameters.get(name, {}), **own, 'lockstep': self._lockstep}
        overrides = [Parameter(key, value=value) for key, value in values.items()]
        node = kind(context=self._context, namespace=self._namespace, parameter_overrides=overrides)
        node.data_thread = self._thread
        node.get_logger().set_level(LoggingSeverity.WARN)  # the command speaks for it
        peer = Node(
            'mount_replay',
            context=self._context,
            namespace=self._namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )
        path = DataPath(peer, lockstep=self._lockstep, thread=self._thread)
        try:
            transition(node.trigger_configure, node, name)
            senders = [path.sender(topic) for topic in sent]
            for topic, take in receive.items():
                path.subscribe(topic, take)
            path.start()
            assert node.data_path is not None
            ends = (path, node.data_path)
            _wait_for(lambda: not any(end.unmatched() for end in ends), 'connection of all topics')
            yield node, senders
        finally:
            path.stop()
            peer.destroy_node()
            node.close()
            node.destroy_node()


class _Dialogue:
    """Sends the next sample as soon as the one before is answered, on the data thread."""

    def __init__(self, stamps: Times, messages: list[bytes]):
        self._stamps: list[int] = stamps.tolist()
        self._messages = messages
        self._answers: list[bytes] = []
        self.traces: list[bytes] = []
        self._sent = 0
        self._over = threading.Event()
        self.repeated = 0  # setpoints after the last answer: 0 A at the deactivation

    def begin(self, send: Send) -> None:
        """Send the first sample."""
        self._send, self._sent = send, 1
        send(self._messages[0])

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


def displacement_messages(run: ControlRun) -> list[bytes]:
    """Return the messages of the samples of a run."""
    layout = ScalarsLayout(topics.DISPLACEMENT)
    pairs = zip(run.stamps.tolist(), run.displacement.tolist(), strict=True)
    return [layout.pack(stamp, (value,)) for stamp, value in pairs]


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
    verdict, counts = node.judge(), node.loop.counts
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


def _wait_for(condition: Callable[[], bool], what: str) -> None:
    limit = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > limit:
            raise ReplayError(f'{what} did not come within {PATIENCE:g} s')
        time.sleep(0.001)
