"""The chunks of a file as columns: a recording of 2 h has 200 000, of which objects would take 0.1 GB."""

from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.container.mcap_reading.chunks import Chunk

Places = NDArray[np.int64]
"""Numbers of chunks in their table, rising."""

ROW = np.dtype(
    [
        ('position', '<i8'),
        ('begin', '<i8'),
        ('end', '<i8'),
        ('size', '<i8'),
        ('crc', '<u4'),
        ('kind', '<u4'),
        ('start_time', '<u8'),
        ('end_time', '<u8'),
        ('index_length', '<i8'),
    ]
)
"""What is known of a chunk, as in `Chunk`; `kind` is the number of what it has in common with others."""

_UNSIGNED = (1 << 64) - 1


class Kind(NamedTuple):
    """What is the same in very many chunks, as in `Chunk`."""

    compression: str
    channels: frozenset[int] | None


class ChunkTable(Sequence[Chunk]):
    """Chunks in a row; one that is asked for by its number is made then, and changes nothing here.

    `rows` (n,) of dtype `ROW`; `kinds` are those to which its chunks belong, and no others.
    """

    def __init__(self, rows: np.ndarray, kinds: Sequence[Kind]):
        self.rows, self.kinds = rows, tuple(kinds)

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, place: int) -> Chunk: ...
    @overload
    def __getitem__(self, place: slice) -> list[Chunk]: ...
    def __getitem__(self, place: int | slice) -> Chunk | list[Chunk]:
        if isinstance(place, slice):
            return [self[each] for each in range(*place.indices(len(self)))]
        position, begin, end, size, crc, kind, start, last, index_length = self.rows[place].item()
        compression, channels = self.kinds[kind]
        return Chunk(position, begin, (end,), size, crc, compression, start, last, index_length, channels)

    def holding(self, channels: Collection[int]) -> Places:
        """Return the numbers of the chunks with messages of one of `channels`, or that do not tell theirs."""
        return self._of_kinds(
            kind.channels is None or not kind.channels.isdisjoint(channels) for kind in self.kinds
        )

    def gaps(self, begin: int, end: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where the stretches from `begin` to `end` without chunks and their indexes begin and end.

        There is one before each chunk and one behind the last; bytes of the file.
        """
        rows = self.rows
        return (
            np.concatenate([[begin], rows['end'] + rows['index_length']]),
            np.concatenate([rows['position'], [end]]),
        )

    @property
    def plain(self) -> bool:
        """Whether all of them tell their channels, and are not packed or packed as this project does."""
        return all(kind.channels is not None and kind.compression in ('', 'zstd') for kind in self.kinds)

    @property
    def unprotected(self) -> int:
        """How many of them hold something without a checksum."""
        return int(np.count_nonzero((self.rows['size'] > 0) & (self.rows['crc'] == 0)))

    @property
    def protected(self) -> int:
        """How many of them carry a checksum."""
        return int(np.count_nonzero(self.rows['crc']))

    @property
    def times(self) -> tuple[int, int] | None:
        """The earliest and the latest time (ns) of their messages, None where no chunk holds one."""
        # Without indexes, whether a chunk holds messages shows in its times alone.
        unknown = self._of_kinds(kind.channels is None for kind in self.kinds)
        holding = np.union1d(
            self._of_kinds(bool(kind.channels) for kind in self.kinds),
            unknown[self.rows['end_time'][unknown] > 0],
        )
        told = self.rows[holding]
        return (int(told['start_time'].min()), int(told['end_time'].max())) if len(told) else None

    def _of_kinds(self, wanted: Iterable[bool]) -> Places:
        return np.flatnonzero(np.fromiter(wanted, np.bool_, len(self.kinds))[self.rows['kind']])


def joined(tables: Sequence[ChunkTable]) -> ChunkTable:
    """Return the chunks of several tables in the order of their positions."""
    known: dict[Kind, int] = {}
    rows, end = np.empty(sum(map(len, tables)), ROW), 0
    for table in tables:
        begin, end = end, end + len(table)
        rows[begin:end] = table.rows
        kinds = [known.setdefault(kind, len(known)) for kind in table.kinds]
        rows['kind'][begin:end] = np.array(kinds, np.uint32)[table.rows['kind']]
    if (rows['position'][1:] < rows['position'][:-1]).any():
        rows = rows[np.argsort(rows['position'], kind='stable')]
    return ChunkTable(rows, list(known))


def chunk_table(chunks: Iterable[Chunk]) -> ChunkTable:
    """Return the table of chunks that are known one by one."""
    known: dict[Kind, int] = {}
    rows = [
        (
            chunk.position,
            chunk.begin,
            chunk.end,
            chunk.size,
            chunk.crc,
            known.setdefault(Kind(chunk.compression, chunk.channels), len(known)),
            chunk.start_time & _UNSIGNED,  # damaged ones may be below 0, read with a sign
            chunk.end_time & _UNSIGNED,
            chunk.index_length,
        )
        for chunk in chunks
    ]
    return ChunkTable(np.array(rows, ROW), list(known))
