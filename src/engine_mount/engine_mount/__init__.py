"""The desk: works on recordings and simulations of the engine mount."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from engine_mount.recordings import Recording


def open(path: str | os.PathLike[str]) -> Recording:
    """Return the recording at `path`, a folder or one file; raises `ReadingError`."""
    from engine_mount.recordings import open_recording  # only here: an import of the package stays cheap

    return open_recording(path)
