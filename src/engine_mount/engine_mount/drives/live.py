"""Plays a recording by the wall clock: its topics are published, or the real mount_control answers it."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.context import Context
from rclpy.node import Node

from engine_mount.drives.inputs.consumed_samples import ReplayError
from engine_mount.drives.inputs.input import has, replay_input
from engine_mount.drives.lockstep import ControlPlayer, displacement_messages
from engine_mount.drives.replay import check_parameters, parsed_changes, with_changes
from engine_mount.recordings.place import open_mount
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.registry import registered_topic
from engine_mount.recordings.screen import Bar, Screen
from mount_bringup.graph.domain import domain_lock
from mount_bringup.graph.nodes import SIMULATED
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.nodes.process import ros_context
from mount_ros.publishers import present_nodes
from mount_ros.topics import Delivery

_LOOK = 0.6  # s: as long as a running graph needs to be discovered
_SHOW_PERIOD = 0.1  # s

Pace = Callable[[NDArray[np.float64], float], Iterator[int]]


def play_live(
    path: Path,
    screen: Screen,
    *,
    mount: str = '',
    rate: float = 1.0,
    begin: float = 0.0,
    with_control: bool = False,
    changes: Mapping[str, Any] | None = None,
    domain: int = 0,
    namespace: str = '',
) -> None:
    """Play a recording from `begin` (s) on, `rate` times as fast as it was recorded, to its end.

    With control only its displacement and its gaps are published, and mount_control answers, with `changes`
    of its recorded parameters. Raises `ReplayError` with the reason where it cannot.
    """
    recording = open_mount(path, mount)
    if not has(recording, topics.DISPLACEMENT):
        raise ReplayError(f'{path} holds no displacement; it has {", ".join(recording.topics)}')
    if not 0.01 <= rate <= 100.0:
        raise ReplayError(f'--rate ({rate:g}) must lie within 0.01 .. 100')
    if changes and not with_control:
        raise ReplayError('--set changes nothing while recorded messages are shown; add --with-control')
    for warning in recording.warnings:
        screen.note(warning)
    with domain_lock(domain, namespace), ros_context(domain) as context, screen.bar('playing') as show:
        _refuse_beside_a_graph(context, namespace)
        pace = partial(_paced, rate=rate, show=show)
        if with_control:
            _play_to_control(recording, parsed_changes(changes or {}), context, namespace, begin, pace)
        else:
            _play_topics(recording, context, namespace, begin, pace)


def _play_topics(recording: Recording, context: Context, namespace: str, begin: float, pace: Pace) -> None:
    """Publish every topic of the registry that was recorded."""
    played = {
        name: topic
        for name, entry in recording.topics.items()
        if entry.message_count and (topic := registered_topic(name, entry.type)) is not None
    }
    series = [recording[name] for name in played]
    arrivals = np.concatenate([each.receive_times for each in series])
    of_topic = np.repeat(np.arange(len(series)), [len(each) for each in series])
    place = np.concatenate([np.arange(len(each)) for each in series])
    order = np.argsort(arrivals, kind='stable')
    times = (arrivals[order] - arrivals[order[0]]) * 1e-9
    owner = Node('mount_replay', namespace=namespace, context=context, enable_rosout=False)
    path = DataPath(owner)
    try:
        senders = [path.sender(topic) for topic in played.values()]
        for number, topic in enumerate(played.values()):  # what holds at the beginning
            before = np.flatnonzero(of_topic[order[: np.searchsorted(times, begin)]] == number)
            if topic.delivery is Delivery.LATCHED and before.size:
                senders[number](series[number].payloads[int(place[order[before[-1]]])])
        for due in pace(times, begin):
            owner_of, its_place = int(of_topic[order[due]]), int(place[order[due]])
            senders[owner_of](series[owner_of].payloads[its_place])
    finally:
        path.stop()
        owner.destroy_node()


def _play_to_control(
    recording: Recording,
    changes: Mapping[str, Mapping[str, Any]],
    context: Context,
    namespace: str,
    begin: float,
    pace: Pace,
) -> None:
    """Activate mount_control at the beginning of each recorded run and send it the samples."""
    given = replay_input(recording)
    parameters = with_changes(given.parameters, changes)
    check_parameters(parameters)
    ignored = dict.fromkeys((topics.CURRENT_SETPOINT, topics.CONTROL_TRACE), lambda raw: None)
    player = ControlPlayer(context, parameters, namespace, lockstep=False)
    for run in given.controls:
        times = given.seconds(run.stamps)
        part = slice(int(np.searchsorted(times, begin)), None)
        if not len(times[part]):
            continue
        rest = replace(run, stamps=run.stamps[part], displacement=run.displacement[part])
        messages = displacement_messages(rest)
        with player.active_control(rest, run.gap, ignored) as (node, send):
            for due in pace(times[part], float(times[part][0])):
                send(messages[due])
            node.trigger_deactivate()


def _paced(times: NDArray[np.float64], begin: float, *, rate: float, show: Bar) -> Iterator[int]:
    """Yield the numbers of the rising `times` (s) from `begin` on, each when it is due; show the position."""
    if not 0.0 <= begin < times[-1]:
        raise ReplayError(f'--from ({begin:g} s) must lie within 0 .. {times[-1]:.3f} s')
    start, shown = time.monotonic(), 0.0
    for number in range(int(np.searchsorted(times, begin)), len(times)):
        position = float(times[number])
        wait = (position - begin) / rate - (time.monotonic() - start)
        if wait > 0.0:
            time.sleep(wait)
        if time.monotonic() - shown > _SHOW_PERIOD:
            shown = time.monotonic()
            show(position / float(times[-1]), detail=f'{position:.1f} s of {times[-1]:.1f} s')
        yield number


def _refuse_beside_a_graph(context: Context, namespace: str) -> None:
    """A replayed displacement beside a real one would reach the controller that drives a coil."""
    looking = Node('mount_replay', namespace=namespace, context=context, enable_rosout=False)
    names, end = {node.name for node in SIMULATED}, time.monotonic() + _LOOK
    try:
        while time.monotonic() < end:
            for name, space in present_nodes(looking):
                if name in names and space == looking.get_namespace():
                    raise ReplayError(
                        f'{name} runs in this ROS domain and namespace {space}: a replay would mix with its '
                        'measurements; choose another --domain or --namespace'
                    )
            time.sleep(0.05)
    finally:
        looking.destroy_node()
