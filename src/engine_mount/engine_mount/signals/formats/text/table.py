"""A text table as named columns."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase
from engine_mount.signals.formats.text.dialect import dialect_of
from engine_mount.signals.formats.text.parsing import columns_of
from engine_mount.signals.signal import SignalError

_SECOND = 1_000_000_000  # ns


class TextTable:
    """A text table whose dialect is found; raises `SignalError`."""

    def __init__(self, path: Path, stated: Stated):
        self.format = 'text table'
        self.reader = 'engine_mount.signals'
        self._path = path
        self._dialect = dialect_of(path, stated)
        self.notes = list(self._dialect.notes)
        kinds = self._dialect.kinds
        texts = [one.header for one in self._dialect.headings if kinds[one.number] == 'text']
        if texts:
            self.notes.append(f'{", ".join(texts)}: no numbers, left out')
        self._dated = next((one for one in self._dialect.headings if one.date), None)
        self.headings = [
            replace(one, timed=self._dated is not None)
            for one in self._dialect.headings
            if kinds[one.number] != 'text'
        ]

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen columns, on the times of the first column of dates where there is one."""
        needed = [*chosen, *([self._dated] if self._dated is not None else [])]
        places = list(dict.fromkeys(one.number for one in needed))
        values = dict(zip(places, columns_of(self._path, self._dialect, places), strict=True))
        time = None
        if self._dated is not None:
            stamps = values[self._dated.number]
            if not stamps.size:
                raise SignalError(f'{self._path} holds no samples; needed are lines below the titles')
            begin = int(stamps[0])
            told = f'dates in column {self._dated.header!r}, taken as UTC where they name no zone'
            time = TimeBase((stamps - begin) / _SECOND, begin, told)
        return [one.measured(_numbers(values[one.number], date=one.date), time) for one in chosen]


def _numbers(values: np.ndarray, *, date: bool) -> np.ndarray:
    return values / _SECOND if date else np.asarray(values, np.float64)
