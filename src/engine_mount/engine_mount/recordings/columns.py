"""Chosen columns of topics, part by part, for recordings that are longer than the memory."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Column
from engine_mount.recordings.times import Times

PART = 1 << 13
"""Messages of a topic in a part at most, chosen: where nothing asks for fewer."""


@dataclass(frozen=True, eq=False)
class ColumnPart:
    """Messages of a topic in the order of the file: stamps and log times (ns), and columns that each has."""

    topic: str
    stamps: Times
    receive_times: Times
    columns: Mapping[str, Column]

    def __len__(self) -> int:
        return len(self.stamps)

    def column(self, name: str) -> Column:
        """Return a column; NaN where its messages have none of that name."""
        return self.columns[name] if name in self.columns else np.full(len(self), np.nan)


def column_parts(
    recording: Recording, columns: Mapping[str, tuple[str, ...]], size: int = PART
) -> Iterator[ColumnPart]:
    """Yield columns of topics, {topic: names}, in the order of the files, at most `size` messages each."""
    wanted = {recording.resolve(topic): names for topic, names in columns.items()}
    for series in recording.parts(wanted, size):
        found = {name: series[name] for name in wanted[series.topic] if name in series.names}
        yield ColumnPart(series.topic, series.stamps, series.receive_times, found)
