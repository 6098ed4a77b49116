"""How often a store is asked again, and how long is waited in between."""

import random
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from engine_mount.signals.extras import MissingLibraryError
from engine_mount.signals.sources.filesystems import forget_connections
from engine_mount.signals.sources.reasons import is_lasting, remedy, told
from engine_mount.signals.sources.source import SourceError, StoreAwayError
from engine_mount.signals.sources.uris import shown

T = TypeVar('T')


@dataclass(frozen=True)
class Patience:
    """Attempts without a byte of progress, and the pauses between: doubled each time, shortened by chance.

    All numbers are chosen: the nine pauses of ten attempts take 23.75 s to 47.5 s, so that a store may be
    away for 20 s. A store that takes requests and does not answer uses up the time instead. The chance keeps
    many workers from asking all at once; `seed` makes it the same each time.
    """

    attempts: int = 10
    standstill: float = 100.0  # s without a byte, behind which there is no other attempt
    first: float = 0.5  # s
    longest: float = 8.0  # s
    seed: int | None = None

    def pauses(self) -> Iterator[float]:
        """Yield the pauses in s, one fewer than there are attempts."""
        chance = random.Random(self.seed)
        for number in range(self.attempts - 1):
            yield min(self.longest, self.first * 2.0**number) * chance.uniform(0.5, 1.0)


class Attempts:
    """What was tried on one URI since there was last progress."""

    def __init__(self, uri: str, patience: Patience, pause: Callable[[float], None] = time.sleep):
        self._uri = uri
        self._patience = patience
        self._pause = pause
        self._begun = time.monotonic()
        self.progress()

    def progress(self) -> None:
        """Begin to count anew: something came."""
        self._failed = 0
        self._moved = time.monotonic()
        self._pauses = self._patience.pauses()

    def failed(self, error: Exception) -> None:
        """Wait before the next attempt; raises `SourceError` where there is none.

        `StoreAwayError` where the attempts or their time are used up.
        """
        if isinstance(error, (SourceError, MissingLibraryError)):
            raise error
        self._failed += 1
        if is_lasting(error):
            raise SourceError(self._sentence(error)) from error
        pause = next(self._pauses, None)
        if pause is None or time.monotonic() - self._moved > self._patience.standstill:
            raise StoreAwayError(self._sentence(error)) from error
        self._pause(pause)
        forget_connections(self._uri)

    def _sentence(self, error: Exception) -> str:
        tries = ''
        if self._failed > 1:
            tries = f' ({self._failed} attempts within {time.monotonic() - self._begun:.0f} s)'
        help_ = remedy(error, self._uri)
        return f'{shown(self._uri)}: {told(error)}{tries}' + (f'; {help_}' if help_ else '')


def persistent(uri: str, work: Callable[[], T], patience: Patience) -> T:
    """Return what `work` returns, asked again while its connection breaks; raises `SourceError`."""
    attempts = Attempts(uri, patience)
    while True:
        try:
            return work()
        except Exception as error:  # of any library below fsspec; sorted by `is_lasting`
            attempts.failed(error)
