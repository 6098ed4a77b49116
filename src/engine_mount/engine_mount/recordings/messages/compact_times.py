"""Times of very many messages in little memory, exact to the nanosecond.

Times that follow one another differ by nearly the same step. Block by block the steps are kept as what they
are above the least of them, in as few bytes as that needs, and these packed by zstd: at 1 kHz 0 to 2 instead
of 8.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.messages.packed_column import Bytes, InBlocks, Slabs, unpacked

Times = NDArray[np.int64]

_WORD = 8  # bytes of a time


class _Block(NamedTuple):
    """Some of the times: the first, the least, the highest; steps above `least_step` where they differ.

    `above` are `width` planes, of the lowest, the next, ... byte of each step; packed where that is shorter.
    """

    size: int
    first: int
    least: int
    highest: int
    least_step: int
    width: int
    above: Bytes

    def times(self) -> Times:
        found = np.empty(self.size, np.int64)
        found[0] = self.first
        found[1:] = 0
        planes = unpacked(self.above, (self.size - 1) * self.width)
        found[1:].view(np.uint8).reshape(-1, _WORD)[:, : self.width] = planes.reshape(
            self.width, self.size - 1
        ).T
        found[1:] += self.least_step
        return np.cumsum(found, out=found)


class CompactTimes(InBlocks[np.int64]):
    """A column of times (ns) in the order in which they were added, to be read block by block."""

    def __init__(self) -> None:
        super().__init__()
        self.rising = True
        """Whether none is below the one before it."""
        self.longest_step = 0
        """The largest distance of two that follow one another, ns."""
        self.strictly_rising = True
        """Whether each is above the one before it."""
        self._blocks: list[_Block] = []
        self._slabs = Slabs()
        self._last = 0

    @property
    def least(self) -> int:
        """The least of the times, of which there must be one."""
        return min(block.least for block in self._blocks)

    @property
    def highest(self) -> int:
        """The highest of the times, of which there must be one."""
        return max(block.highest for block in self._blocks)

    @property
    def firsts(self) -> Times:
        """The first time of each block."""
        return np.array([block.first for block in self._blocks], np.int64)

    def block(self, number: int) -> Times:
        """Return the times of one block."""
        return self._blocks[number].times()

    def blocks(self) -> Iterator[Times]:
        """Yield the times, at most `BLOCK` at once."""
        return (block.times() for block in self._blocks)

    def steps(self) -> Iterator[Times]:
        """Yield what each time is above the one before it, block by block."""
        last = None
        for block in self.blocks():
            yield np.diff(block) if last is None else np.diff(block, prepend=last)
            last = block[-1]

    def at(self, places: NDArray[np.intp]) -> Times:
        """Return the times at these places, counted from 0."""
        found = np.empty(len(places), np.int64)
        ends = np.cumsum([block.size for block in self._blocks])
        numbers = np.searchsorted(ends, places, side='right')
        for number in np.unique(numbers).tolist():
            here, block = numbers == number, self._blocks[number]
            found[here] = block.times()[places[here] - (ends[number] - block.size)]
        return found

    def places_of(self, times: Times) -> NDArray[np.intp]:
        """Return at which places one of `times`, which rise, stands."""
        found, begin = [np.empty(0, np.intp)], 0
        for block in self.blocks():
            found.append(begin + np.flatnonzero(is_in(block, times)))
            begin += len(block)
        return np.concatenate(found)

    def whole(self, numbers: Sequence[int] | None = None) -> Times:
        """Return all times at once, or those of the blocks with these numbers."""
        blocks = self._blocks if numbers is None else [self._blocks[number] for number in numbers]
        times, end = np.empty(sum(block.size for block in blocks), np.int64), 0
        for block in blocks:
            begin, end = end, end + block.size
            times[begin:end] = block.times()
        return times

    def ordered(self) -> 'CompactTimes':
        """Return the times sorted; in memory at once are those of blocks that reach into each other."""
        if self.rising:
            return self
        found = CompactTimes()
        for numbers in self.overlapping():
            times = self.whole(numbers)
            times.sort()
            found.add(times)
        return found.finished()

    def has_any(self, begin: int, end: int) -> bool:
        """Return whether one of the times is from `begin` to `end`."""
        near = (block for block in self._blocks if block.least <= end and block.highest >= begin)
        return any(bool(within(block.times(), begin, end).size) for block in near)

    def overlapping(self) -> Iterator[list[int]]:
        """Yield the numbers of blocks, those together that reach into each other, in the order of time."""
        found, highest = list[int](), 0
        for number in sorted(range(len(self._blocks)), key=lambda number: self._blocks[number].least):
            block = self._blocks[number]
            if found and block.least > highest:
                yield sorted(found)
                found = []
            highest = max(highest, block.highest) if found else block.highest
            found.append(number)
        if found:
            yield sorted(found)

    def _keep(self, times: Times) -> None:
        steps = np.diff(times)
        border = int(times[0]) - self._last if self._blocks else 0
        least = int(steps.min()) if steps.size else 0
        highest = int(steps.max()) if steps.size else 0
        self.longest_step = max(self.longest_step, abs(border), abs(least), abs(highest))
        # Compared, for the step between times that are too far apart does not fit into its bits.
        self.rising = self.rising and border >= 0 and bool((times[1:] >= times[:-1]).all())
        above = border > 0 or not self._blocks
        self.strictly_rising = self.strictly_rising and above and bool((times[1:] > times[:-1]).all())
        width = -(-(highest - least).bit_length() // 8)
        found = _Block(
            len(times),
            int(times[0]),
            int(times.min()),
            int(times.max()),
            least,
            width,
            self._slabs.kept(_planes(steps - least, width)),
        )
        self._blocks.append(found)
        self._last = int(times[-1])


def compact(times: 'Times | CompactTimes') -> CompactTimes:
    """Return times as a column that needs little memory."""
    if isinstance(times, CompactTimes):
        return times
    found = CompactTimes()
    found.add(times)
    return found.finished()


def together(columns: Sequence[CompactTimes]) -> Iterator[list[Times]]:
    """Yield rising columns stretch by stretch: the distinct times of each in the same stretch of time."""
    sources = [column.blocks() for column in columns]
    held = [np.empty(0, np.int64) for _ in columns]
    border: int | None = None
    while True:
        for place, source in enumerate(sources):
            while not len(held[place]) and (block := next(source, None)) is not None:
                held[place] = block if border is None else block[block > border]
        if not any(map(len, held)):
            return
        border = min(int(times[-1]) for times in held if len(times))
        cuts = [int(np.searchsorted(times, border, side='right')) for times in held]
        yield [distinct(times[:cut]) for times, cut in zip(held, cuts, strict=True)]
        held = [times[cut:] for times, cut in zip(held, cuts, strict=True)]


def distinct(times: Times) -> Times:
    """Return rising times, each once."""
    return times[np.append(True, times[1:] > times[:-1])] if len(times) else times


def each_once(times: Times) -> tuple[Times, 'slice | NDArray[np.intp]']:
    """Return the distinct times, rising, and where the first of each stands; no copies where they rise."""
    if bool((times[1:] > times[:-1]).all()):
        return times, slice(None)
    return np.unique(times, return_index=True)


def within(times: Times, begin: int, end: int) -> Times:
    """Return the times from `begin` to `end`."""
    return times[(times >= begin) & (times <= end)]


def is_in(times: Times, known: Times) -> NDArray[np.bool_]:
    """Return which of the times are among `known`, which rise."""
    if not len(known):
        return np.zeros(len(times), bool)
    return known[np.minimum(np.searchsorted(known, times), len(known) - 1)] == times


def _planes(above: Times, width: int) -> NDArray[np.uint8]:
    """Return the lowest `width` bytes of numbers, the lowest of each first, then the next of each."""
    return np.ascontiguousarray(above.view(np.uint8).reshape(-1, _WORD)[:, :width].T).reshape(-1)
