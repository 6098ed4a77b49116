"""Chunk index records of a summary: what the end of an MCAP file tells of its chunks, all of them at once."""

from collections.abc import Callable

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from engine_mount.recordings.container.mcap_reading.chunk_table import ROW, ChunkTable, Kind
from engine_mount.recordings.container.mcap_reading.chunks import CRC_PLACE, LARGEST_CHUNK, SHORTEST_CHUNK
from engine_mount.recordings.container.stored import rows_at

Bytes = NDArray[np.uint8]
Offsets = NDArray[np.int64]
_FIRST = np.dtype(
    [('start', '<u8'), ('end', '<u8'), ('position', '<u8'), ('length', '<u8'), ('offsets', '<u4')]
)
_OFFSET = np.dtype([('channel', '<u2'), ('position', '<u8')])  # of the message index of a channel
_SIZES = np.dtype(
    [('index', '<u8'), ('name', '<u4')]
)  # bytes of the message indexes, of the compression's name
_LAST = np.dtype([('packed', '<u8'), ('unpacked', '<u8')])  # bytes of the chunk's messages
_SHORTEST = _FIRST.itemsize + _SIZES.itemsize + _LAST.itemsize
_FARTHEST = np.uint64(1 << 61)  # bytes, chosen: sums of what is not larger are exact, and no file is as long
_NEVER = 0xFFFFFFFF  # chosen: of bytes that are 0 it is another
_AT_ONCE = 1 << 14  # records whose channels are in memory at once, chosen


def indexed_chunks(data: Bytes, begins: Offsets, ends: Offsets) -> ChunkTable | None:
    """Return the chunks of which records tell, in the order of their positions; None if one is not readable.

    The contents of the records are `data[begins[i]:ends[i]]`. What the chunks themselves tell is not yet in
    the table (`take_checksums`).
    """
    if (ends - begins < _SHORTEST).any():
        return None
    first = _fields(data, begins, _FIRST)
    offsets = begins + _FIRST.itemsize
    behind = offsets + first['offsets']
    if (first['offsets'] % _OFFSET.itemsize).any() or (
        behind + _SIZES.itemsize + _LAST.itemsize > ends
    ).any():
        return None
    sizes = _fields(data, behind, _SIZES)
    names = behind + _SIZES.itemsize
    name_ends = names + sizes['name']
    if (name_ends + _LAST.itemsize > ends).any():
        return None
    last = _fields(data, name_ends, _LAST)
    rows = np.zeros(len(begins), ROW)
    rows['position'] = _clipped(first['position'])
    rows['end'] = rows['position'] + _clipped(first['length'])
    rows['begin'] = rows['end'] - _clipped(last['packed'])
    rows['size'], rows['index_length'] = _clipped(last['unpacked']), _clipped(sizes['index'])
    rows['start_time'], rows['end_time'] = first['start'], first['end']
    compressions, spelled = _distinct(data, names, name_ends, _text)
    channels, listed = _distinct(data, offsets, behind, _channels)
    sets = [frozenset(np.frombuffer(each, '<u2').tolist()) for each in listed]
    common = (compressions * len(sets) + channels) * 2 + (sizes['index'] > 0)
    found, rows['kind'] = np.unique(common, return_inverse=True)
    try:
        texts = [text.decode() for text in spelled]
    except UnicodeDecodeError:
        return None
    kinds = [
        Kind(texts[each // 2 // len(sets)], sets[each // 2 % len(sets)] if each % 2 else None)
        for each in found.tolist()
    ]
    return ChunkTable(rows[np.argsort(rows['position'], kind='stable')], kinds)


def can_be_there(table: ChunkTable, size: int) -> bool:
    """Return whether a file of so many bytes can hold all these chunks."""
    rows = table.rows
    sound = (rows['end'] <= size) & (rows['begin'] >= rows['position'] + SHORTEST_CHUNK)
    return bool((sound & (rows['size'] <= LARGEST_CHUNK)).all())


def take_checksums(data: Bytes, rows: np.ndarray) -> None:
    """Note in rows of a table the checksums, which the heads of the chunks tell; they must be in `data`.

    Where there is neither a chunk nor a checksum, as in the hole of an outline, it is one that never holds.
    """
    rows['crc'] = _fields(data, rows['position'] + CRC_PLACE, np.dtype('<u4'))
    missing = (rows['crc'] == 0) & (data[rows['position']] != Opcode.CHUNK)
    rows['crc'][missing] = _NEVER


def _fields(data: Bytes, places: Offsets, fields: np.dtype) -> np.ndarray:
    return rows_at(data, places, fields.itemsize).view(fields)[:, 0] if len(places) else np.empty(0, fields)


def _clipped(numbers: NDArray[np.uint64]) -> NDArray[np.int64]:
    return np.minimum(numbers, _FARTHEST).astype(np.int64)


def _distinct(
    data: Bytes, begins: Offsets, ends: Offsets, told: Callable[[Bytes], Bytes]
) -> tuple[NDArray[np.int64], list[bytes]]:
    """Return for each of n places the number of what is `told` by its bytes, and all that is told.

    `told` makes of rows (m, bytes) others (m, of any number), of which the same tell the same.
    """
    known: dict[bytes, int] = {}
    numbers = np.empty(len(begins), np.int64)
    for width in np.unique(ends - begins).tolist():
        at = np.flatnonzero(ends - begins == width)
        for part in np.split(at, range(_AT_ONCE, len(at), _AT_ONCE)):
            rows = told(rows_at(data, begins[part], width))
            fresh = np.ones(len(rows), np.bool_)  # others are as the one before
            fresh[1:] = (rows[1:] != rows[:-1]).any(axis=1)
            found = [known.setdefault(row.tobytes(), len(known)) for row in rows[fresh]]
            numbers[part] = np.array(found)[np.cumsum(fresh) - 1]
    return numbers, list(known)


def _text(rows: Bytes) -> Bytes:
    return rows


def _channels(rows: Bytes) -> Bytes:
    """Return the sorted channels in rows of offsets: in any order they are the same set."""
    offsets = rows.reshape(-1).view(_OFFSET).reshape(len(rows), -1)
    return np.sort(offsets['channel'], axis=1).view(np.uint8)
