"""What a made file is: where it lies, how its columns are called, and what it does not tell itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import FloatArray

Columns = Mapping[str, tuple[str, FloatArray]]
BEGIN = 1_700_000_000  # s since 1970, of formats that tell a date


@dataclass(frozen=True)
class Made:
    """A file: where it is, what must be stated, how each column is called, and that of times ('': none)."""

    path: Path
    names: Mapping[str, str]
    time: str = ''
    stated: Stated = field(default_factory=Stated)
    units: bool = True


Maker = Callable[[Path, str, FloatArray, Columns], Made]
