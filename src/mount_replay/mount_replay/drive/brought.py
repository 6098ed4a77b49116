"""What of others a drive is given, brought into the plain form that the simulator reads."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol


class Brought(Protocol):
    """A recorded acceleration, or a road: read, checked, not yet written."""

    @property
    def kind(self) -> str:
        """What the session calls it, `recorded` or `road`."""
        ...

    @property
    def told(self) -> Mapping[str, Any]:
        """What the session tells of its origin, as plain data."""
        ...

    @property
    def notes(self) -> Sequence[str]:
        """What was done to it or taken for granted, in sentences."""
        ...

    def write(self, folder: Path) -> dict[str, Any]:
        """Write the files that the simulator reads into `folder`; return the parameters that name them."""
        ...
