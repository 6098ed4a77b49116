"""Very many small records, packed: a recording of 2 h has 200 000 chunks, which as objects take 0.1 GB."""

from array import array
from collections.abc import Callable, Hashable, Sequence
from typing import Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

T = TypeVar('T')


class PackedRows(Sequence[T], Generic[T]):
    """Records made when they are asked for, of whole numbers and of what is the same in many of them."""

    def __init__(self, make: Callable[..., T], width: int):
        """Take what makes a record of its `width` numbers (64 bit, not negative) and its common values."""
        self._make, self._width = make, width
        self._numbers = array('Q')
        self._kinds = array('L')
        self._common: dict[tuple[Hashable, ...], int] = {}
        self._known: list[tuple[Hashable, ...]] = []

    def __len__(self) -> int:
        return len(self._kinds)

    def add(self, numbers: Sequence[int], *common: Hashable) -> None:
        """Add a record."""
        kind = self._common.setdefault(common, len(self._known))
        if kind == len(self._known):
            self._known.append(common)
        self._numbers.extend(numbers)
        self._kinds.append(kind)

    def column(self, place: int) -> NDArray[np.uint64]:
        """Return one number of all records; none can be added while it is held."""
        return np.frombuffer(self._numbers, np.uint64)[place :: self._width]

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> list[T]: ...
    def __getitem__(self, place: int | slice) -> T | list[T]:
        if isinstance(place, slice):
            return [self[each] for each in range(*place.indices(len(self)))]
        number = range(len(self))[place]
        begin = self._width * number
        numbers = self._numbers[begin : begin + self._width]
        return self._make(*numbers, *self._known[self._kinds[number]])
