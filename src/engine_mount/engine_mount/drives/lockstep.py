"""Replay through the real mount_control over topics: a sample is sent when the one before was answered.

Player and node share this process and one data thread, in a namespace of their own, so that a graph which
runs in the same domain neither receives nor disturbs them. A sample that is not answered ends the replay.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from rclpy.context import Context
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.parameter import Parameter

from engine_mount.drives.core import (
    OFF,
    ControlAnswers,
    Progress,
    Replayed,
    activation_before,
    replay_parts,
)
from engine_mount.drives.inputs.consumed_samples import Column, ControlRun, MeasuredGap, ReplayError
from engine_mount.drives.inputs.input import ReplayInput
from engine_mount.settings.chosen import Parameters
from mount_control.node import MountControl
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.diagnostics import Level
from mount_ros.nodes.process import ros_context, transition

PATIENCE = 10.0  # s, chosen: a node that answers later does not answer
_LOOK_PERIOD = 0.1  # s

Send = Callable[[bytes], None]


def replay_in_lockstep(
    given: ReplayInput, parameters: Parameters, domain: int, progress: Progress = lambda share: None
) -> Replayed:
    """Replay all runs through mount_control, initialisations in core; raises a `ValueError` for a refusal."""
    total = sum(len(run.stamps) for run in given.controls)
    done = 0
    values = {**parameters.get('mount_control', {}), 'lockstep': True}
    overrides = [Parameter(key, value=value) for key, value in values.items()]
    with ros_context(domain) as context:
        thread = DataThread(context)

        def play_run(run: ControlRun, gap: MeasuredGap) -> ControlAnswers:
            nonlocal done
            dialogue = _Dialogue(run)
            with _active_control(context, thread, overrides, gap, dialogue) as (node, send):
                dialogue.begin(send)
                dialogue.wait(lambda samples: progress((done + samples) / total))
                answers = _control_answers(run, dialogue, node)
                node.trigger_deactivate()
                if answers.setpoints[-1] != OFF:
                    _wait_for(lambda: dialogue.repeated == 1, '0 A at the deactivation of mount_control')
            done += len(run.stamps)
            return answers

        return replay_parts(given, parameters, play_run)


@contextmanager
def _active_control(
    context: Context,
    thread: DataThread,
    overrides: list[Parameter],
    gap: MeasuredGap,
    dialogue: '_Dialogue',
) -> Iterator[tuple[MountControl, Send]]:
    """Give mount_control, active with `gap` before the first sample, and what sends samples."""
    own: dict[str, Any] = {'context': context, 'namespace': f'/replay_{os.getpid()}'}
    node = MountControl(parameter_overrides=overrides, **own)
    node.data_thread = thread
    node.get_logger().set_level(LoggingSeverity.WARN)  # the command speaks for it
    peer = Node('mount_replay', start_parameter_services=False, enable_rosout=False, **own)
    path = DataPath(peer, lockstep=True, thread=thread)
    try:
        transition(node.trigger_configure, node, 'mount_control')
        send = path.sender(topics.DISPLACEMENT)
        senders = [path.sender(topic) for topic in (topics.AIR_GAP, topics.CURRENT_FORCE_TABLE)]
        path.subscribe(topics.CURRENT_SETPOINT, dialogue.take_setpoint)
        path.subscribe(topics.CONTROL_TRACE, dialogue.traces.append)
        path.start()
        assert node.data_path is not None
        ends = (path, node.data_path)
        _wait_for(lambda: not any(end.unmatched() for end in ends), 'connection of all topics')
        stamp = activation_before(dialogue.stamps[0])
        for send_part, raw in zip(senders, gap.dated(stamp).messages(), strict=True):
            send_part(raw)
        send(ScalarsLayout(topics.DISPLACEMENT).pack(stamp, (dialogue.first,)))
        transition(node.trigger_activate, node, 'mount_control')
        yield node, send
    finally:
        path.stop()
        peer.destroy_node()
        node.close()
        node.destroy_node()


class _Dialogue:
    """Sends the next sample as soon as the one before is answered, on the data thread."""

    def __init__(self, run: ControlRun):
        self.stamps: list[int] = run.stamps.tolist()
        self.first = float(run.displacement[0])
        layout = ScalarsLayout(topics.DISPLACEMENT)
        rows = layout.pack_rows(run.stamps, run.displacement[:, None])
        self._messages = [row.tobytes() for row in rows]
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
        if answered == self._sent or stamp_of(raw) != self.stamps[answered]:
            self.repeated += self._over.is_set()
            return
        self._answers.append(raw)
        if self._sent < len(self._messages):
            self._sent += 1
            self._send(self._messages[self._sent - 1])
        else:
            self._over.set()

    def wait(self, progress: Callable[[int], None]) -> None:
        """Return when every sample is answered; raise `ReplayError` when one is not for `PATIENCE` s."""
        answered, since = 0, time.monotonic()
        while not self._over.wait(_LOOK_PERIOD):
            if len(self._answers) != answered:
                answered, since = len(self._answers), time.monotonic()
                progress(answered)
            elif time.monotonic() - since > PATIENCE:
                raise ReplayError(
                    f'sample {answered} of {len(self.stamps)} ({self.stamps[answered] / 1e9:.3f} s) was '
                    f'not answered within {PATIENCE:g} s; mount_control does not answer'
                )

    def setpoints(self) -> Column:
        """Return the setpoints (A) of all samples."""
        unpack = ScalarsLayout(topics.CURRENT_SETPOINT).unpack
        return np.array([unpack(raw)[1][0] for raw in self._answers])


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
