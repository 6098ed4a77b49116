"""The marks in a recording, and what "now" is where they are set."""

from mount_bags.messages.series import Series
from mount_ros.messages.event import Mark, read_mark

_HOUR = 3_600_000_000_000  # ns


def read_marks(events: Series) -> list[Mark]:
    """Return the marks of a recording in the order in which they were set, from `recording['event']`."""
    messages = zip(events.messages(), events.receive_times.tolist(), strict=True)
    return [read_mark(message.data, received) for message, received in messages]


def present_time(clock: int, last_stamp: int) -> int:
    """Return "now" on the clock of the stamps, ns: the system's unless the stamps run on one of their own.

    In lock-step the stamps begin at 0; then now is the stamp that came last.
    """
    return last_stamp if last_stamp and abs(clock - last_stamp) > _HOUR else clock
