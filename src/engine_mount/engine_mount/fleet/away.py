"""A run ends when its store does not answer any more: told once, not for each recording that is left."""

from engine_mount.fleet.runner import Done
from engine_mount.signals.sources.source import StoreAwayError

IN_A_ROW = 4
"""Recordings in a row for which a store did not answer, after which a run ends; chosen."""


class StoreWatch:
    """Counts the recordings in a row for which a store did not answer."""

    def __init__(self) -> None:
        self._in_a_row = 0

    def take(self, done: Done[object]) -> None:
        """Take what came of one recording; raises `StoreAwayError` after `IN_A_ROW` without an answer."""
        if not isinstance(done.error, StoreAwayError):
            self._in_a_row = 0
            return
        self._in_a_row += 1
        if self._in_a_row == IN_A_ROW:
            raise StoreAwayError(
                f'the store was given up after {IN_A_ROW} recordings in a row (what was done stands, and the '
                f'same command goes on where it stopped): {done.error}'
            )


def reason_of(done: Done[object]) -> str:
    """Return why a task has no result: of a store its own sentence."""
    return str(done.error) if isinstance(done.error, StoreAwayError) else done.reason
