"""Chunks in the order of their file, near ones together, with little of the file in memory."""

import mmap
from collections.abc import Iterator

import numpy as np

from engine_mount.recordings.container.mcap_reading.chunk_table import ChunkTable, Places
from engine_mount.recordings.container.whole_files import forget

_KEPT = 1 << 22  # bytes of the file in memory while the chunks are looked at, chosen


def passing(data: mmap.mmap, chunks: ChunkTable, places: Places) -> Iterator[Places]:
    """Yield the numbers of chunks, near ones together; the system may take back what stands before them.

    That is all of the file before, for what stands beside a chunk is read with it.
    """
    positions, first, forgotten = chunks.rows['position'][places], 0, 0
    while first < len(places):
        last = int(np.searchsorted(positions, positions[first] + _KEPT, 'right'))
        yield places[first:last]
        end = int(chunks.rows['end'][places[last - 1]])
        forget(data, forgotten, end)
        first, forgotten = last, end
