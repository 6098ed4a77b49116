"""Who publishes: the nodes of the graph, and others on a topic whose writers the registry names.

The answer comes from discovery, not from what is sent: a stranger is known before its first message is used.
A killed writer stays in discovery until its lease is over, and looks like a second one of its name.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.node import Node
from rclpy.subscription import Subscription

from mount_ros.topics import Topic

LONGEST_DOUBT = 6.0
"""How long two writers may bear one name, s: the lease of a killed one (5 s, `dds/`), and 1 s (chosen)."""

_CHECK_PERIOD = 0.05  # s, chosen: while an activation waits
_KILLED = f'a killed one is gone after {LONGEST_DOUBT:g} s'
_NAMELESS = '_NODE_NAME_UNKNOWN_'  # rmw_fastrtps, until the name has come


class PublisherConflictError(ValueError):
    """A topic that decides on the coil's current has a publisher that is not its own."""


@dataclass
class WatchedTopic:
    """What is known of the publishers of one topic."""

    subscription: Subscription
    count: int = -1
    """Of publishers at the last check."""
    confirmed: str = ''
    suspected: str = ''
    since: float = 0.0  # of the suspicion, s, steady clock


class PublisherWatch:
    """Holds the publishers of the watched topics against those that the registry names; for any thread.

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
        self._watched: dict[Topic, WatchedTopic] = {}
        self._guard = threading.Lock()
        self._reporting = threading.RLock()

    def add(self, topic: Topic, subscription: Subscription) -> WatchedTopic:
        """Watch the writers of `topic`."""
        with self._guard:
            return self._watched.setdefault(topic, WatchedTopic(subscription))

    def remove(self, *topics: Topic) -> None:
        """Watch the writers of `topics` no more."""
        with self._guard:
            for topic in topics:
                self._watched.pop(topic, None)

    def check(self) -> None:
        """Check who publishes each topic: 15 us each."""
        with self._guard:
            before = self.confirmed, self.suspected
            for topic, watched in self._watched.items():
                watched.count = watched.subscription.get_publisher_count()
                confirmed, suspected = self._others(topic)
                now = time.monotonic()
                watched.since = watched.since if watched.suspected else now
                if now - watched.since > LONGEST_DOUBT:
                    confirmed, suspected = confirmed or suspected, []
                watched.confirmed = _sentence(topic, confirmed, 'end it')
                watched.suspected = _sentence(topic, suspected, f'{_KILLED}, else end it')
            every = self._watched.values()
            self.confirmed = next((each.confirmed for each in every if each.confirmed), '')
            self.suspected = next((each.suspected for each in every if each.suspected), '')
            changed = before != (self.confirmed, self.suspected)
        if changed:
            self.report()

    def report(self) -> None:
        """Call `on_change` with what holds now."""
        with self._reporting:
            with self._guard:
                conflict = self.confirmed, self.suspected
            self._on_change(*conflict)

    def wait_for_sole(self, ending: threading.Event) -> None:
        """Return when no other writer is there; raise `PublisherConflictError` if one is confirmed."""
        while True:
            self.check()
            if not (self.confirmed or self.suspected):
                return
            if self.confirmed or ending.wait(_CHECK_PERIOD):
                raise PublisherConflictError(self.confirmed or self.suspected)

    def _others(self, topic: Topic) -> tuple[list[str], list[str]]:
        """Return the publishers of `topic` that are certainly not its own, and those that may not be."""
        names = Counter(
            f'{info.node_namespace.rstrip("/")}/{info.node_name}'
            for info in self._node.get_publishers_info_by_topic(topic.name)
            if info.topic_type == topic.type
        )
        twice = sorted(name for name, count in names.items() if count > 1)
        if len(names) <= 1:  # one name alone stands in for the writers, or is one of them
            return [], twice
        space = self._node.get_namespace().rstrip('/')
        others = names.keys() - {f'{space}/{writer}_io' for writer in topic.writers}
        nameless = {name for name in others if name.endswith(_NAMELESS)}
        return sorted(others - nameless), twice or sorted(nameless)


def _sentence(topic: Topic, names: list[str], remedy: str) -> str:
    if not names:
        return ''
    who = ' and '.join('a node without a name' if _NAMELESS in name else name for name in names)
    own = ' and '.join(topic.writers)
    return f'{who} must not publish {topic.name} too (limit: one writer, {own}): {remedy}'
