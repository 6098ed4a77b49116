"""Plays a recording by the wall clock: topics are published, keys control it, a line tells the position."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray
from rclpy.node import Node

from engine_mount.drives.inputs.input import Notes, ReplayError, has, recorded_parameters
from engine_mount.drives.inputs.ramps import MeasuredGap, measured_gaps
from engine_mount.drives.keyboard import Keyboard
from engine_mount.drives.live.live_control import LiveControl
from engine_mount.drives.live.playback import Playback
from engine_mount.drives.replay import check_parameters, with_changes
from engine_mount.recordings.place import open_mount
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Screen
from engine_mount.recordings.series import Payloads
from engine_mount.settings.chosen import Parameters
from mount_bringup.graph.domain import domain_lock
from mount_bringup.graph.nodes import SIMULATED
from mount_recorder.topic_groups import registered_topic
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import message_class
from mount_ros.messages.scalars import stamp_of
from mount_ros.nodes.process import ros_context
from mount_ros.publishers import present_nodes
from mount_ros.topics import Delivery, Topic

_SHOWN = (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.AIR_GAP, topics.CURRENT_FORCE_TABLE)
_ANSWERS = (topics.CURRENT_SETPOINT.name, topics.CONTROL_TRACE.name)
_SEEK = {'left': -1.0, 'right': 1.0, 'up': 10.0, 'down': -10.0}  # s
_LOOK = 0.6  # s: as long as a running graph needs to be discovered
_LINE_PERIOD = 0.1  # s
_LONGEST_WAIT = 0.05  # s
_KEYS = 'space: pause, left/right: 1 s (paused: right is one sample), up/down: 10 s, q: end'


@dataclass(frozen=True)
class LiveOrder:
    """What is to be played; `begin` in s."""

    recording: Path
    rate: float = 1.0
    begin: float = 0.0
    topic_names: str = ''
    with_control: bool = False
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    domain: int = 0
    namespace: str = ''
    mount: str = ''


@dataclass
class _Film:
    """All messages that are shown in the order of time (s): of which topic, and their place there."""

    topics: list[Topic]
    payloads: list[Payloads]
    times: NDArray[np.float64]
    topic_of: NDArray[np.int64]
    place_of: NDArray[np.int64]
    samples: NDArray[np.float64]


def play_live(order: LiveOrder, screen: Screen) -> None:
    """Play to the end, to `q` or to Ctrl-C; raises `ReplayError` with the reason where it cannot."""
    recording = open_mount(order.recording, order.mount)
    if not 0.01 <= order.rate <= 100.0:
        raise ReplayError(f'--rate ({order.rate:g}) must lie within 0.01 .. 100')
    film = _film(recording, _chosen(recording, order))
    if not 0.0 <= order.begin < film.times[-1]:
        raise ReplayError(f'--from ({order.begin:g} s) must lie within 0 .. {film.times[-1]:.3f} s')
    gaps = measured_gaps(recording)
    parameters = _parameters(recording, order, gaps)
    for warning in recording.warnings:
        screen.note(warning)
    with domain_lock(order.domain, order.namespace), ros_context(order.domain) as context:
        owner = Node('mount_replay', namespace=order.namespace, context=context, enable_rosout=False)
        path = DataPath(owner)
        control: LiveControl | None = None
        try:
            _refuse_beside_a_graph(owner)
            senders = [path.sender(topic) for topic in film.topics]
            if parameters is not None:
                control = LiveControl(context, order.namespace, parameters, path)
            _Show(film, senders, control, gaps, order, screen).run()
        finally:
            if control is not None:
                control.close()
            path.stop()
            owner.destroy_node()


class _Show:
    """The loop: keys, messages that are due, the line."""

    def __init__(
        self,
        film: _Film,
        senders: list[Callable[[bytes], None]],
        control: LiveControl | None,
        gaps: list[MeasuredGap],
        order: LiveOrder,
        screen: Screen,
    ):
        self._film, self._senders, self._control, self._gaps = film, senders, control, gaps
        self._rate, self._screen = order.rate, screen
        self._playback = Playback(film.times, film.samples, order.rate, order.begin)
        self._displacement = film.topics.index(topics.DISPLACEMENT)
        self._waiting_gap: MeasuredGap | None = None

    def run(self) -> None:
        """Play until the end or `q`."""
        playback, shown = self._playback, 0.0
        with Keyboard() as keyboard, self._screen.line('') as show:
            if keyboard.present:
                self._screen.say(_KEYS)
            self._arrive()
            playback.play(time.monotonic())
            try:
                while not (playback.finished and not playback.paused):
                    now = time.monotonic()
                    for number in playback.due(now):
                        self._publish(number)
                    if keyboard.present and now - shown > _LINE_PERIOD:
                        shown = now
                        show(self._line(now))
                    wait = min(playback.until_next(time.monotonic()), _LONGEST_WAIT)
                    for key in keyboard.wait(wait):
                        if key == 'q':
                            return
                        self._obey(key, time.monotonic())
            except KeyboardInterrupt:
                raise typer.Exit(130) from None
            finally:
                self._screen.say(self._line(time.monotonic()))

    def _obey(self, key: str, now: float) -> None:
        playback = self._playback
        if key == 'space':
            (playback.play if playback.paused else playback.pause)(now)
        elif key == '.' or (key == 'right' and playback.paused):
            playback.step(now)
        elif key in _SEEK:
            playback.seek(now, _SEEK[key])
            self._arrive()

    def _arrive(self) -> None:
        """After a jump latched topics say what holds here, and the controller is activated anew."""
        film, place = self._film, self._playback.next
        for topic, entry in enumerate(film.topics):
            if entry.delivery is Delivery.LATCHED:
                before = np.flatnonzero(film.topic_of[:place] == topic)
                if before.size:
                    self._send(int(before[-1]))
        following = np.flatnonzero(film.topic_of[place:] == self._displacement)
        if self._control is not None and following.size:
            self._control.rest()
            stamp = stamp_of(self._raw(place + int(following[0])))
            earlier = [gap for gap in self._gaps if gap.stamp < stamp]
            self._waiting_gap = earlier[-1] if earlier else None

    def _publish(self, number: int) -> None:
        topic = int(self._film.topic_of[number])
        if topic == self._displacement and self._control is not None and self._waiting_gap is not None:
            now = time.monotonic()
            was_paused = self._playback.paused
            self._playback.pause(now)
            self._control.begin(self._waiting_gap, self._raw(number))
            self._waiting_gap = None
            if not was_paused:
                self._playback.play(time.monotonic())  # activation takes none of the recording's time
            return
        self._send(number)
        if self._control is not None and self._film.topics[topic] is topics.CURRENT_FORCE_TABLE:
            self._waiting_gap = self._gap_after(number)

    def _send(self, number: int) -> None:
        topic = int(self._film.topic_of[number])
        if self._control is not None and self._film.topics[topic] in _SHOWN[2:]:
            return  # the controller gets them when it is activated, dated as its measurements
        self._senders[topic](self._raw(number))

    def _raw(self, number: int) -> bytes:
        return self._film.payloads[int(self._film.topic_of[number])][int(self._film.place_of[number])]

    def _gap_after(self, number: int) -> MeasuredGap | None:
        """Return the gap that a table message belongs to: tables are recorded in the order of their gaps."""
        place = int(self._film.place_of[number])
        return self._gaps[min(place, len(self._gaps) - 1)] if self._gaps else None

    def _line(self, now: float) -> str:
        state = 'paused' if self._playback.paused else f'x {self._rate:g}'
        return f'{self._playback.position(now):10.3f} s of {self._playback.length:.3f} s  {state}'


def _chosen(recording: Recording, order: LiveOrder) -> dict[str, Topic]:
    """Return {full name in the recording: topic to publish}."""
    if not has(recording, topics.DISPLACEMENT):
        raise ReplayError(f'{order.recording} holds no displacement; it has {", ".join(recording.topics)}')
    names = [name.strip() for name in order.topic_names.split(',') if name.strip()]
    if names == ['all']:
        wanted = [name for name, topic in recording.topics.items() if topic.message_count]
    else:
        wanted = [recording.resolve(topic.name) for topic in _SHOWN if has(recording, topic)]
        wanted += [recording.resolve(name) for name in names]
    chosen = {}
    for name in wanted:
        topic = registered_topic(name, recording.topics[name].type) or _unregistered(recording, name)
        if topic is not None and not (order.with_control and topic.name in _ANSWERS):
            chosen[name] = topic
    return chosen


def _unregistered(recording: Recording, name: str) -> Topic | None:
    kind = recording.topics[name].type
    try:
        message_class(kind)
    except ValueError as error:
        recording.warnings.append(f'{name} is not played: {error}')
        return None
    return Topic(name.lstrip('/'), kind, Delivery.STREAM, 0.0, 'not of this project')


def _film(recording: Recording, chosen: dict[str, Topic]) -> _Film:
    assert recording.time_range is not None
    begin = recording.time_range[0]
    series = [recording[name] for name in chosen]
    times = [(entry.receive_times - begin) / 1e9 for entry in series]
    everything = np.concatenate(times)
    order = np.argsort(everything, kind='stable')
    topic_of = np.repeat(np.arange(len(series)), [len(entry) for entry in series])
    place_of = np.concatenate([np.arange(len(entry)) for entry in series])
    entries = list(chosen.values())
    samples = np.unique(times[entries.index(topics.DISPLACEMENT)])
    payloads = [entry.payloads for entry in series]
    return _Film(entries, payloads, everything[order], topic_of[order], place_of[order], samples)


def _parameters(recording: Recording, order: LiveOrder, gaps: list[MeasuredGap]) -> Parameters | None:
    if not order.with_control:
        if order.changes:
            raise ReplayError('--set changes nothing while recorded messages are shown; add --with-control')
        return None
    if not gaps:
        raise ReplayError(f'{order.recording} holds no air_gap with its table: --with-control cannot begin')
    recorded = recorded_parameters(recording, Notes())
    parameters = with_changes(recorded, order.changes)
    check_parameters(parameters)
    return parameters


def _refuse_beside_a_graph(owner: Node) -> None:
    """A replayed displacement beside a real one would reach the controller that drives a coil."""
    names = {node.name for node in SIMULATED}
    end = time.monotonic() + _LOOK
    while time.monotonic() < end:
        for name, space in present_nodes(owner):
            if name in names and space == owner.get_namespace():
                raise ReplayError(
                    f'{name} runs in this ROS domain and namespace {space}: a replay would mix with its '
                    'measurements; choose another --domain or --namespace'
                )
        time.sleep(0.05)
