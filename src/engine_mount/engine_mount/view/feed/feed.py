"""What every feed gives: the messages of the topics of one mount, by and by."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from mount_ros.topics import Topic


class FeedError(ValueError):
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


class Feed(Protocol):
    """Calls `receive` with every message in the order of arrival, from a thread of its own."""

    @property
    def topics(self) -> Mapping[str, Topic]:
        """{name with namespace: topic} of all that may come."""

    @property
    def title(self) -> str:
        """What is looked at, in a few words."""

    @property
    def live(self) -> bool:
        """Whether the messages come from a running graph."""

    def start(self, receive: Receive, on_failure: Fail) -> None:
        """Begin; messages come until `stop`, or until `on_failure` was called."""

    def stop(self) -> None:
        """Return when no message comes any more; safe to call twice."""

    def mark(self) -> str:
        """Ask the recorder of the graph to mark this moment; return what it answered."""
