"""How many messages a file has by topic, and between which times."""

from engine_mount.recordings.container.stored import StoredMessages


class Tally:
    """`counts` of messages by channel, and their earliest and latest `times` (ns), None without any."""

    def __init__(self) -> None:
        self.counts: dict[int, int] = {}
        self.times: tuple[int, int] | None = None

    def add(self, messages: StoredMessages) -> None:
        """Count messages, of which there is one at least."""
        for channel, count in messages.counts().items():
            self.count(channel, count)
        self.widen(messages)

    def count(self, channel: int, count: int) -> None:
        """Count so many messages of a channel."""
        self.counts[channel] = self.counts.get(channel, 0) + count

    def widen(self, messages: StoredMessages) -> None:
        """Take the times of messages, of which there is one at least."""
        times = messages.heads['log_time']
        self.widen_to(int(times.min()), int(times.max()))

    def widen_to(self, first: int, last: int) -> None:
        """Take two times (ns) that are not farther apart than they should be."""
        if self.times is not None:
            first, last = min(first, self.times[0]), max(last, self.times[1])
        self.times = first, last
