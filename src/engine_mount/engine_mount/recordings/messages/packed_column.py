"""Columns of very many numbers, taken piece by piece and kept block by block in little memory, to the bit."""

import mmap
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Generic, Self, TypeVar

import numpy as np
import zstandard
from numpy.typing import NDArray

Kind = TypeVar('Kind', np.float64, np.int64)

Bytes = NDArray[np.uint8]
Column = NDArray[np.float64]

BLOCK = 1 << 13  # numbers, chosen: so that one long step between times makes few others take more bytes
_WORD = 8  # bytes of a number
_SLAB = 1 << 20  # bytes that are taken from the system at once, chosen
_LEVEL = 1  # of zstd, chosen: the fastest of those that count how often a byte comes


class InBlocks(ABC, Generic[Kind]):
    """A column that fills from behind; blocks hold `BLOCK` numbers, the last one those that are left."""

    def __init__(self) -> None:
        self._waiting: list[NDArray[Kind]] = []
        self._waiting_count = self._kept_count = 0

    def __len__(self) -> int:
        return self._kept_count + self._waiting_count

    def add(self, numbers: NDArray[Kind]) -> None:
        """Add numbers behind the others; the array is not to be changed afterwards."""
        self._waiting.append(numbers)
        self._waiting_count += len(numbers)
        if self._waiting_count >= BLOCK:
            waiting = np.concatenate(self._waiting)
            whole = len(waiting) - len(waiting) % BLOCK
            for begin in range(0, whole, BLOCK):
                self._take(waiting[begin : begin + BLOCK])
            self._waiting, self._waiting_count = [waiting[whole:].copy()], len(waiting) - whole

    def finished(self) -> Self:
        """Return itself with all that was added in blocks; columns of one length have equal ones."""
        if self._waiting_count:
            self._take(np.concatenate(self._waiting))
        self._waiting, self._waiting_count = [], 0
        return self

    def _take(self, numbers: NDArray[Kind]) -> None:
        self._keep(numbers)
        self._kept_count += len(numbers)

    @abstractmethod
    def _keep(self, numbers: NDArray[Kind]) -> None:
        """Keep one more block."""


class Slabs:
    """Memory that goes back to the system with its owner; small pieces of the heap would stay there."""

    def __init__(self) -> None:
        self._free = np.empty(0, np.uint8)

    def kept(self, data: Bytes) -> Bytes:
        """Return a copy of `data` (n,), packed where that is shorter."""
        data = _packed(data)
        if data.size > len(self._free):
            self._free = np.frombuffer(mmap.mmap(-1, max(_SLAB, data.size), mmap.MAP_PRIVATE), np.uint8)
        place, self._free = self._free[: data.size], self._free[data.size :]
        place[:] = data
        return place


class PackedColumn(InBlocks[np.float64]):
    """Numbers, read as `CompactTimes` are; those of a sensor repeat themselves and take half the bytes."""

    def __init__(self) -> None:
        super().__init__()
        self._blocks: list[tuple[int, Bytes]] = []  # how many numbers, and their bytes
        self._slabs = Slabs()

    def block(self, number: int) -> Column:
        """Return the numbers of one block."""
        size, kept = self._blocks[number]
        return unpacked(kept, size * _WORD).view(np.float64)

    def blocks(self) -> Iterator[Column]:
        """Yield the numbers, at most `BLOCK` at once."""
        return map(self.block, range(len(self._blocks)))

    def whole(self, numbers: Sequence[int] | None = None) -> Column:
        """Return all of them at once, or those of the blocks with these numbers."""
        blocks = self.blocks() if numbers is None else map(self.block, numbers)
        return np.concatenate([np.empty(0), *blocks])

    def _keep(self, numbers: Column) -> None:
        self._blocks.append((len(numbers), self._slabs.kept(np.ascontiguousarray(numbers).view(np.uint8))))


def packed(numbers: Column) -> PackedColumn:
    """Return numbers (n,) as a column that needs less memory."""
    found = PackedColumn()
    found.add(numbers)
    return found.finished()


def unpacked(kept: Bytes, length: int) -> Bytes:
    """Return the `length` bytes of which `Slabs` kept a copy."""
    if len(kept) == length:
        return kept
    return np.frombuffer(zstandard.ZstdDecompressor().decompress(kept.data, max_output_size=length), np.uint8)


def _packed(data: Bytes) -> Bytes:
    if not len(data):
        return data
    packed = zstandard.ZstdCompressor(level=_LEVEL).compress(data.data)
    return np.frombuffer(packed, np.uint8) if len(packed) < len(data) else data
