"""Free space on the disk of a recording, looked at before it is used up."""

import shutil
from collections.abc import Callable
from pathlib import Path

RESERVE = 200_000_000  # bytes, chosen: what the recorder leaves to the rest of the system


class SpaceGuard:
    """Says when the disk that holds `folder` (or will hold it) has less than `reserve` bytes left."""

    def __init__(
        self,
        folder: Path,
        reserve: int = RESERVE,
        free_of: Callable[[Path], int] = lambda place: shutil.disk_usage(place).free,
    ):
        self._place = folder
        self._reserve = reserve
        self._free_of = free_of

    def free(self) -> int:
        """Return the free bytes of the disk."""
        place = self._place
        while not place.exists() and place != place.parent:
            place = place.parent
        return self._free_of(place)

    def shortage(self) -> str:
        """Return what is wrong, empty while there is enough."""
        free = self.free()
        if free >= self._reserve:
            return ''
        return (
            f'{free / 1e6:.0f} MB left on the disk of {self._place}, less than the '
            f'{self._reserve / 1e6:.0f} MB that free_reserve keeps'
        )
