"""Where messages come from: a running graph, or a recording by the clock."""

import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_mount.recordings.recording import open_mount
from mount_bringup.graph.nodes import GraphError
from mount_ros.topics import DISPLACEMENT, TOPICS, Topic

_PERIOD = 0.01  # s, chosen
_PERIOD_OF_GRAPH = 0.02  # s, chosen: less than a picture of the page


class FeedError(GraphError):
    """There is nothing to look at; the text says why and what would help."""


class Message(NamedTuple):
    """A serialised message of a topic of the registry; times in ns: when it arrived, when it was sent."""

    topic: Topic
    raw: bytes
    received: int
    sent: int


Receive = Callable[[Message], None]
Fail = Callable[[str], None]
"""Takes the sentence on the exception that has ended a feed."""


class RecordedFeed:
    """A recording of one mount, `rate` times as fast as it was recorded.

    It begins at `begin` (s from the first displacement sample).
    """

    def __init__(self, path: Path, rate: float = 1.0, begin: float = 0.0, namespace: str = ''):
        """Raises a `ValueError` for what is no recording, or for a `begin` that lies beyond it."""
        part = open_mount(path, namespace, '--namespace')
        self.topics: Mapping[str, Topic] = {part.resolve(t.name): t for t in TOPICS if t.name in part}
        self.title = f'{part.short_name} at {rate:g} x'
        part.load(self.topics)
        self.zero: int | None = part.time_axis.zero
        self._series = [(topic, part[name]) for name, topic in self.topics.items()]
        times = [series.receive_times for _, series in self._series]
        if not sum(map(len, times)):
            raise ValueError(f'{path} holds no message of the topics of a mount')
        arrivals = np.concatenate(times)
        order = np.argsort(arrivals, kind='stable')
        self._arrivals = arrivals[order]
        self._owners = np.repeat(np.arange(len(times)), [*map(len, times)])[order]
        self._places = np.concatenate([np.arange(len(each)) for each in times])[order]
        samples = [each.receive_times for topic, each in self._series if topic is DISPLACEMENT and len(each)]
        self._seconds = (self._arrivals - (*samples, self._arrivals)[0][0]) * 1e-9
        if not 0.0 <= begin <= self._seconds[-1]:
            raise ValueError(f'--from ({begin:g} s) must lie within 0 .. {self._seconds[-1]:.3f} s')
        self._rate, self._begin = rate, begin
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def __len__(self) -> int:
        return len(self._arrivals)

    def message(self, number: int) -> Message:
        """Return a message by its place in the order of arrival."""
        topic, series = self._series[self._owners[number]]
        place = int(self._places[number])
        received, sent = int(self._arrivals[number]), int(series.publish_times[place])
        return Message(topic, series.payloads[place], received, sent)

    def start(self, receive: Receive, on_failure: Fail) -> None:
        """Give out what was latched before the beginning, then play."""

        def serve() -> None:
            try:
                self._play(receive)
            except Exception as error:
                # The border of the thread: without a sentence the recording would seem to be over.
                on_failure(f'{self.title} was not played to its end: {type(error).__name__}: {error}')

        self._thread = threading.Thread(target=serve, name='recorded', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End; safe to call twice."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()

    def _play(self, receive: Receive) -> None:
        due = int(np.searchsorted(self._seconds, self._begin))
        for owner, (topic, _) in enumerate(self._series):
            before = np.flatnonzero(self._owners[:due] == owner)
            if topic.rate == 0.0 and before.size:
                receive(self.message(before[-1]))
        started = time.monotonic()
        while due < len(self) and not self._ending.wait(_PERIOD):
            position = self._begin + self._rate * (time.monotonic() - started)
            end = np.searchsorted(self._seconds, position, side='right')
            while due < end and not self._ending.is_set():
                receive(self.message(due))
                due += 1


class RunningGraph:
    """The graph of one mount in a ROS domain and namespace."""

    def __init__(self, domain: int, namespace: str = ''):
        """Raises `FeedError` where no process can reach another."""
        # ROS, which no recording needs
        from rclpy.context import Context
        from rclpy.node import Node

        from mount_ros.environment import loopback_refusal, prepare_environment

        if refusal := loopback_refusal():
            raise FeedError(refusal)
        prepare_environment()
        self._context = Context()
        self._context.init(domain_id=domain)
        self._node = Node(
            'engine_mount_view', namespace=namespace, context=self._context, enable_rosout=False
        )
        self._collector: Any = None
        self.topics = {self._node.resolve_topic_name(topic.name): topic for topic in TOPICS}
        self.title = f'running graph, ROS domain {domain}, namespace {self._node.get_namespace()}'
        self.zero: int | None = None
        self._stopped = False

    def start(self, receive: Receive, on_failure: Fail) -> None:
        """Begin to take messages."""
        from mount_recorder.collector import Collector
        from mount_ros.qos import control_qos

        self._collector = Collector(self._node, period=_PERIOD_OF_GRAPH, on_failure=on_failure)
        for topic in TOPICS:
            self._collector.collect(
                topic,
                lambda *found, own=topic: receive(Message(own, *found)),
                control_qos(topic, lockstep=False),
            )
        self._collector.start()

    def stop(self) -> None:
        """End the subscriptions and leave the middleware."""
        if self._stopped:
            return
        self._stopped = True
        if self._collector is not None:
            self._collector.stop()
        self._node.destroy_node()
        self._context.try_shutdown()


Feed = RecordedFeed | RunningGraph
"""The messages of the topics of one mount, {name with namespace: topic}, in the order of arrival.

`zero` is the stamp (ns) at which time begins; None: the first that comes. `start` calls `receive` with each
message, from a thread, until `stop`, which is safe to call twice, or until `on_failure` was called.
"""
