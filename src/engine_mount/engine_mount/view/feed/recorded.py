"""The messages of a recording, given out by the clock at any rate."""

import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from engine_mount.recordings.place import open_run
from engine_mount.view.feed.feed import Fail, FeedError, Message, Receive
from mount_ros.topics import DISPLACEMENT, TOPICS, Topic

_PERIOD = 0.01  # s, chosen
_LOWEST_RATE, _HIGHEST_RATE = 0.01, 1000.0


class Recorded:
    """A recording of one mount, from `begin` (s) on, `rate` times as fast as it was recorded."""

    live = False

    def __init__(self, path: Path, rate: float = 1.0, begin: float = 0.0, namespace: str = ''):
        """Raises `FeedError`, or `ReadingError` for what is no recording."""
        if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
            raise FeedError(f'--rate ({rate:g}) must lie within {_LOWEST_RATE:g} .. {_HIGHEST_RATE:g}')
        recording = open_run(path)
        self.topics: Mapping[str, Topic] = _topics_of(recording.topics, namespace, path)
        self.title = f'{recording.short_name} at {rate:g} x'
        recording.load(self.topics)
        self._series = [(topic, recording[name]) for name, topic in self.topics.items()]
        arrivals = np.concatenate([series.receive_times for _, series in self._series])
        owners = np.repeat(
            np.arange(len(self._series)), [len(series.receive_times) for _, series in self._series]
        )
        places = np.concatenate([np.arange(len(series.receive_times)) for _, series in self._series])
        order = np.argsort(arrivals, kind='stable')
        self._arrivals, self._owners, self._places = arrivals[order], owners[order], places[order]
        if not len(order):
            raise FeedError(f'{path} holds no message of the topics of a mount')
        times = (self._arrivals - self._arrivals[0]) * 1e-9
        if not 0.0 <= begin <= times[-1]:
            raise FeedError(f'--from ({begin:g} s) must lie within 0 .. {times[-1]:.3f} s')
        self._times, self._rate, self._begin = times, rate, begin
        self._next = int(np.searchsorted(times, begin))
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='recorded', daemon=True)

    @property
    def time_range(self) -> tuple[int, int]:
        """Arrival of the first and the last message, ns."""
        return int(self._arrivals[0]), int(self._arrivals[-1])

    def start(self, receive: Receive, on_failure: Fail) -> None:
        """Give out what was latched before the beginning, then play."""
        self._receive, self._on_failure = receive, on_failure
        self._thread.start()

    def stop(self) -> None:
        """End; safe to call twice."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def mark(self) -> str:
        """Say that a recording cannot be marked from here."""
        return 'no mark was set: this is a recording'

    def _serve(self) -> None:
        try:
            self._play()
        except Exception as error:
            # The border of the thread: without a sentence the recording would seem to be over.
            self._on_failure(f'{self.title} was not played to its end: {type(error).__name__}: {error}')

    def _play(self) -> None:
        self._repeat_latched()
        start = time.monotonic()
        while not self._ending.is_set() and self._next < len(self._times):
            position = self._begin + self._rate * (time.monotonic() - start)
            while self._next < len(self._times) and self._times[self._next] <= position:
                if self._ending.is_set():
                    return
                self._receive(self._message(self._next))
                self._next += 1
            self._ending.wait(_PERIOD)

    def _repeat_latched(self) -> None:
        """Give out the last message before the beginning of topics that come once."""
        for owner, (topic, _) in enumerate(self._series):
            before = np.flatnonzero(self._owners[: self._next] == owner)
            if topic.rate == 0.0 and before.size:
                self._receive(self._message(int(before[-1])))

    def _message(self, number: int) -> Message:
        topic, series = self._series[self._owners[number]]
        place = int(self._places[number])
        received, sent = int(self._arrivals[number]), int(series.publish_times[place])
        return Message(topic, series.payloads[place], received, sent)


def _topics_of(recorded: Mapping[str, object], namespace: str, path: Path) -> dict[str, Topic]:
    """Return the topics of one mount; raises `FeedError` where several mounts were recorded."""
    ending = f'/{DISPLACEMENT.name}'
    spaces = sorted(name.removesuffix(ending) for name in recorded if name.endswith(ending))
    space = f'/{namespace.strip("/")}' if namespace.strip('/') else ''
    if not namespace and len(spaces) == 1:
        space = spaces[0]
    if spaces and space not in spaces:
        named = ', '.join(name.lstrip('/') or '/' for name in spaces)
        raise FeedError(f'{path} holds the mounts {named}: choose one with --namespace')
    names = {
        f'{space}/{topic.name}' if not topic.name.startswith('/') else topic.name: topic for topic in TOPICS
    }
    return {name: topic for name, topic in names.items() if name in recorded}
