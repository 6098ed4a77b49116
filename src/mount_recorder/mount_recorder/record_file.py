"""A file that grows by whole records, can be cut back to the last of them, and keeps room for its end."""

import contextlib
import os
from pathlib import Path

RESERVE_STEP = 1 << 20  # bytes, chosen: the summary of about 6000 chunks


class RecordFile:
    """An append-only file, written past every buffer of this process.

    A second, hidden file holds disk space back. When the disk is full that file gives its space to
    the end of this one, so that the recording is closed like any other.
    """

    def __init__(self, path: Path):
        self.path = path
        self.size = 0
        self._reserve_path = path.with_name(f'.{path.name}.reserve')
        self._reserve = 0
        self._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)

    def append(self, data: bytes) -> None:
        """Write `data` whole or not at all: on `OSError` the file is cut back to where it was."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._write_some(rest) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._handle, self.size)
                os.lseek(self._handle, self.size, os.SEEK_SET)
            raise
        self.size += len(data)

    def keep_room(self, size: int) -> None:
        """Hold back at least `size` bytes of disk space; raises `OSError` if the disk has no more."""
        if size > self._reserve:
            wanted = -(-size // RESERVE_STEP) * RESERVE_STEP
            # Where the file system cannot allocate, the C library writes: not to a file opened to append.
            handle = os.open(self._reserve_path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            try:
                self._allocate(handle, wanted)
            finally:
                os.close(handle)
            self._reserve = wanted

    def release_room(self) -> None:
        """Give back what `keep_room` holds; safe to call twice."""
        self._reserve = 0
        self._reserve_path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self.release_room()
        if self._handle >= 0:
            handle, self._handle = self._handle, -1
            os.close(handle)

    # What a test replaces to play a full disk.

    def _write_some(self, data: memoryview) -> int:
        return os.write(self._handle, data)

    def _allocate(self, handle: int, size: int) -> None:
        os.posix_fallocate(handle, 0, size)
