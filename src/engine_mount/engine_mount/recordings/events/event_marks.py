"""The marks in a recording."""

from engine_mount.recordings.messages.series import Series
from mount_ros.messages.event import Mark, read_mark


def read_marks(events: Series) -> list[Mark]:
    """Return the marks of a recording in the order in which they were set, from `recording['event']`."""
    messages = zip(events.messages(), events.receive_times.tolist(), strict=True)
    return [read_mark(message.data, received) for message, received in messages]
