"""Which nodes tell nothing any more: one that hangs counts as dead."""

from collections.abc import Sequence

SILENCE_LIMIT = 4.0
"""Seconds (chosen) without diagnostics, which come once a second, after which a node counts as dead."""
_LONGEST_LOOK = 0.5  # s, chosen: ten times as long as the supervisor takes from one look to the next


class Liveliness:
    """Who has not been heard for `SILENCE_LIMIT`; times (s) on the steady clock.

    What passes while nobody looks, as when this process stands still, counts for no one.
    """

    def __init__(self) -> None:
        self._heard: dict[str, float] = {}
        self._looked: float | None = None

    def hear(self, name: str, now: float) -> None:
        """Note that `name` has told something, from now on it must go on doing so."""
        self._heard[name] = now

    def forget(self, name: str) -> None:
        """Expect nothing of `name` until it is heard again."""
        self._heard.pop(name, None)

    def pause(self) -> None:
        """Begin afresh with the next look: meanwhile nobody had to tell anything."""
        self._heard = dict.fromkeys(self._heard, float('inf'))

    def silent(self, now: float) -> list[str]:
        """Return the names that have been silent for too long."""
        looked, self._looked = self._looked, now
        slept = max(0.0, now - looked - _LONGEST_LOOK) if looked is not None else 0.0
        self._heard = {name: min(heard + slept, now) for name, heard in self._heard.items()}
        return [name for name, heard in self._heard.items() if now - heard > SILENCE_LIMIT]


def silence_sentence(names: Sequence[str]) -> str:
    """Return what is to be told of nodes that have been silent for too long: value, limit and remedy."""
    return (
        f'{", ".join(names)} told nothing on /diagnostics for {SILENCE_LIMIT:g} s (limit {SILENCE_LIMIT:g} '
        's, usual is 1 s) and counts as dead: look for what stopped it, into its log and at the load of this '
        'machine'
    )
