"""Chunks that need no checksum of their own, unpacked one behind the other into the same memory each time."""

import mmap

import numpy as np
import zstandard
from numpy.typing import NDArray

from engine_mount.recordings.container.mcap_reading.chunk_table import ChunkTable, Places
from engine_mount.recordings.container.unpacking import unpacking_limit

Bytes = NDArray[np.uint8]
Offsets = NDArray[np.int64]


class Unpacker:
    """The chunks of a file that is `plain` (`McapFile`), unpacked several at a time."""

    def __init__(self, data: mmap.mmap, chunks: ChunkTable):
        self._packed, self._chunks = memoryview(data), chunks
        self._decompressor = zstandard.ZstdDecompressor()
        self._target = np.empty(0, np.uint8)

    def unpacked(self, places: Places) -> tuple[Bytes, Offsets]:
        """Return the bytes of chunks in a row and the end of each among them; the next call overwrites them.

        From the first chunk on that is not what its head says, none is there.
        """
        rows = self._chunks.rows[places]
        ends = np.cumsum(rows['size'])
        if any(map(_is_too_large, rows['size'].tolist(), (rows['end'] - rows['begin']).tolist())):
            return self._target, ends[:0]
        room = int(ends[-1]) + 1  # one byte more, so that a chunk that is too long is seen
        if room > self._target.size:
            try:
                self._target = np.empty(room, np.uint8)
            except MemoryError:
                return self._target, ends[:0]
        count, begin = 0, 0
        whole, compressed = self._target.data, [kind.compression for kind in self._chunks.kinds]
        for kind, first, last, end in zip(
            rows['kind'].tolist(), rows['begin'].tolist(), rows['end'].tolist(), ends.tolist(), strict=True
        ):
            target = whole[begin : end + 1]
            if self._unpack(self._packed[first:last], compressed[kind], target) != end - begin:
                break
            count, begin = count + 1, end
        return self._target, ends[:count]

    def _unpack(self, source: memoryview, compression: str, target: memoryview) -> int:
        """Unpack into a target with one byte more than needed; return how many there are, -1 for none."""
        if not compression:
            if len(source) < len(target):
                target[: len(source)] = source
            return len(source)
        try:
            return self._decompressor.stream_reader(source).readinto(target)
        except zstandard.ZstdError:
            return -1


def _is_too_large(size: int, packed: int) -> bool:
    return size > unpacking_limit(packed)
