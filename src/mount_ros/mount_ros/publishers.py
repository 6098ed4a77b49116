"""Who publishes a topic whose writers the registry names, and who else does.

The answer comes from discovery, not from what is sent: a stranger is known with or before its first message.
A killed writer stays in discovery until its lease is over, and looks like a second one of its name.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.node import Node
from rclpy.subscription import Subscription

from mount_ros.topics import Topic

LONGEST_DOUBT = 6.0
"""How long two writers may bear one name, s: the lease of a killed one (5 s, `dds/`), and 1 s (chosen)."""

NAMING_TIME = 1.0
"""How long discovery may need to name the sender of a message, s, chosen: the name travels by itself."""

_LOOK_PERIOD = 0.05  # s, chosen: while an activation waits
_NAMELESS = '_NODE_NAME_UNKNOWN_'  # rmw_fastrtps, until the name has come


class PublisherConflictError(ValueError):
    """A topic that decides on the coil's current has a publisher that is not its own."""


@dataclass
class _WatchedTopic:
    """What is known of the publishers of one topic."""

    subscription: Subscription
    count: int = -1  # of publishers at the last look
    confirmed: str = ''
    suspected: str = ''
    since: float = 0.0  # of the doubt, s, steady clock


class PublisherWatch:
    """Holds the publishers of the watched topics against those that the registry names; any thread may ask.

    A topic's own writers are the nodes `<writer>_io` in the namespace of `node`, each once. Where none of
    them is there, one other node may stand in for them: a replay or a test bench.
    `on_change(confirmed, suspected)` is called, in the thread that finds it, when they have changed: one call
    at a time, each with what holds then, so that of changes found by two threads the newer one is last.
    """

    def __init__(self, node: Node, on_change: Callable[[str, str], None]):
        self.confirmed = ''
        """Which other node publishes on which topic, and the remedy; empty where none does."""
        self.suspected = ''
        """The same where it may be a killed writer, or one whose name has not come yet."""
        self._node = node
        self._on_change = on_change
        self._watched: dict[Topic, _WatchedTopic] = {}
        self._guard = threading.Lock()
        self._delivery = threading.RLock()

    def watch(self, topic: Topic, subscription: Subscription) -> None:
        """Watch the writers of `topic`."""
        with self._guard:
            self._watched[topic] = _WatchedTopic(subscription)

    def forget(self, topic: Topic) -> None:
        """Watch the writers of `topic` no more."""
        with self._guard:
            self._watched.pop(topic, None)

    def end(self) -> None:
        """Watch nothing any more."""
        with self._guard:
            self._watched.clear()

    def notice(self, topic: Topic) -> None:
        """Look who has come to `topic`, or gone."""
        with self._guard:
            if topic in self._watched:
                self._watched[topic].count = -1
        self.look()

    def look(self) -> None:
        """Look at each topic whose publishers have changed in number, or are in doubt."""
        with self._guard:
            before = self.confirmed, self.suspected
            for topic, watched in self._watched.items():
                count = watched.subscription.get_publisher_count()
                if count != watched.count or watched.suspected:
                    watched.count = count
                    self._judge(topic, watched)
            every = self._watched.values()
            self.confirmed = next((each.confirmed for each in every if each.confirmed), '')
            self.suspected = next((each.suspected for each in every if each.suspected), '')
            changed = before != (self.confirmed, self.suspected)
        if changed:
            self.deliver()

    def deliver(self) -> None:
        """Call `on_change` with what holds now."""
        with self._delivery:
            with self._guard:
                confirmed, suspected = self.confirmed, self.suspected
            self._on_change(confirmed, suspected)

    def wait_for_own(self, ending: threading.Event) -> None:
        """Return when no other writer is there, or raise `PublisherConflictError`; a doubt is waited for."""
        while True:
            self.look()
            if not (self.confirmed or self.suspected):
                return
            if self.confirmed or ending.wait(_LOOK_PERIOD):
                raise PublisherConflictError(self.confirmed or self.suspected)

    def _judge(self, topic: Topic, watched: _WatchedTopic) -> None:
        now = time.monotonic()
        since = watched.since if watched.suspected else now
        confirmed, suspected = self._others(topic)
        if suspected and now - since > LONGEST_DOUBT:
            confirmed, suspected = confirmed or suspected, []
        watched.since = since
        watched.confirmed = _sentence(topic, confirmed, 'end it') if confirmed else ''
        watched.suspected = _sentence(topic, suspected, _IF_KILLED) if suspected else ''

    def _others(self, topic: Topic) -> tuple[list[str], list[str]]:
        """Return the publishers of `topic` that are certainly not its own, and those that may not be."""
        space = self._node.get_namespace().rstrip('/')
        infos = self._node.get_publishers_info_by_topic(topic.name)
        names = [
            _NAMELESS
            if info.node_name == _NAMELESS
            else f'{info.node_namespace.rstrip("/")}/{info.node_name}'
            for info in infos
            if info.topic_type == topic.type
        ]
        own = {f'{space}/{writer}_io' for writer in topic.writers}
        twice = sorted({name for name in names if names.count(name) > 1})
        others = {name for name in names if name not in own}
        nameless = others & {_NAMELESS}
        if len(set(names)) > 1:  # one name alone stands in for the writers, or is one of them
            return sorted(others - nameless), twice or sorted(nameless)
        return [], twice


class UnnamedPublisher:
    """A second writer that is known by what it sends alone, until discovery names it."""

    def __init__(self):
        self._since: float | None = None  # s, steady clock

    def is_awaited(self, nameless: bool) -> bool:
        """Return whether its name may still come: within `NAMING_TIME` of the first call with `nameless`."""
        now = time.monotonic()
        if not nameless:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        return now - self._since < NAMING_TIME


_IF_KILLED = f'a killed one is gone after {LONGEST_DOUBT:g} s, else end it'


def _sentence(topic: Topic, names: list[str], remedy: str) -> str:
    who = ' and '.join(name.replace(_NAMELESS, 'a node without a name') for name in names)
    own = ' and '.join(topic.writers)
    return f'{who} must not publish {topic.name} too (limit: one writer, {own}): {remedy}'
