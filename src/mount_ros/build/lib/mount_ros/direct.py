"""Hands messages from node to node within a process, in the sender's thread and before they are published.

A topic between two nodes of a process costs two changes of thread by way of the middleware. Directly it costs
a call. The topic stays: each message is published as well, for the recorder and everyone else.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

Take = Callable[[bytes], None]


class Receiver:
    """Takes the messages of one topic, directly or by the middleware, one at a time."""

    def __init__(self, line: '_Line', take: Take):
        self._line = line
        self._take: Take | None = take
        self._one_at_a_time = threading.RLock()

    def take(self, raw: bytes) -> None:
        """Take one message; nothing after `end`."""
        with self._one_at_a_time:
            if self._take is not None:
                self._take(raw)

    def take_published(self, raw: bytes) -> None:
        """Take what came by the middleware, unless the topic has its sender in this process.

        Then it is what was taken before, or a stranger's: that one is known from discovery.
        """
        if not self._line.senders:
            self.take(raw)

    def end(self) -> None:
        """Return when no message is taken any more."""
        if self in self._line.receivers:
            self._line.receivers.remove(self)
        with self._one_at_a_time:
            self._take = None


@dataclass
class _Line:
    """The ends of one topic in this process."""

    senders: int = 0
    receivers: list[Receiver] = field(default_factory=list)


class DirectDelivery:
    """The topics that have both ends in this process; nodes that share it share a data thread."""

    def __init__(self) -> None:
        self._lines: dict[str, _Line] = {}

    def sender(self, topic_name: str, publish: Take) -> Take:
        """Return the function that hands a message to the receivers of `topic_name` and publishes it."""
        line = self._line(topic_name)
        line.senders += 1

        def send(raw: bytes) -> None:
            for receiver in line.receivers:
                receiver.take(raw)
            publish(raw)

        return send

    def end_sender(self, topic_name: str) -> None:
        """Note that a sender of `topic_name` is there no more."""
        self._line(topic_name).senders -= 1

    def receiver(self, topic_name: str, take: Take) -> Receiver:
        """Let `take` have the messages of `topic_name`, in the thread of whoever sends them."""
        line = self._line(topic_name)
        receiver = Receiver(line, take)
        line.receivers.append(receiver)
        return receiver

    def _line(self, topic_name: str) -> _Line:
        return self._lines.setdefault(topic_name, _Line())
