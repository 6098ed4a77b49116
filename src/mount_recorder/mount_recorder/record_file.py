"""A file that grows by whole records, can be cut back to the last of them, and keeps room for its end."""

import contextlib
import os
from pathlib import Path

RESERVE_STEP = 1 << 20  # bytes, chosen: the summary of about 6000 chunks


class RecordFile:
    """An append-only file, written past every buffer of this process.

    A second, hidden file holds disk space back. When the disk is full that file gives its space to
    the end of this one, so that the recording is closed like any other. What the end will need is kept in it,
    not in memory: the index of a long recording grows for ever.
    """

    def __init__(self, path: Path):
        self.path = path
        self.size = 0
        self._reserve_path = path.with_name(f'.{path.name}.reserve')
        self._reserve = 0
        self._reserve_handle = -1
        self._kept_size = 0  # bytes of the room that hold what is kept
        self._kept_here = bytearray()  # what the disk did not take
        self._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)

    def append(self, data: bytes) -> None:
        """Write `data` whole or not at all: on `OSError` the file is cut back to where it was."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._write_some(rest) :]
        except OSError:
            with contextlib.suppress(OSError):
                self._cut_back()
            raise
        self.size += len(data)

    def keep_room(self, size: int) -> None:
        """Hold back at least `size` bytes of disk space; raises `OSError` if the disk has no more."""
        if size <= self._reserve:
            return
        if self._reserve_handle < 0:
            flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
            self._reserve_handle = os.open(self._reserve_path, flags, 0o644)
        wanted = -(-size // RESERVE_STEP) * RESERVE_STEP
        self._allocate(self._reserve_handle, wanted)
        self._reserve = wanted

    def keep(self, data: bytes) -> None:
        """Keep `data` for the end of the file, in the room that is held back for it."""
        free = self._reserve - self._kept_size
        if not self._kept_here and len(data) <= free:
            with contextlib.suppress(OSError):
                if os.pwrite(self._reserve_handle, data, self._kept_size) == len(data):
                    self._kept_size += len(data)
                    return
        self._kept_here += data

    def kept(self) -> bytes:
        """Return all that was kept, in its order."""
        on_disk = os.pread(self._reserve_handle, self._kept_size, 0) if self._kept_size else b''
        return on_disk + self._kept_here

    def release_room(self) -> None:
        """Give back what `keep_room` holds; what was kept stays, in memory. Safe to call twice."""
        self._kept_here, self._kept_size = bytearray(self.kept()), 0
        self._reserve = 0
        if self._reserve_handle >= 0:
            os.close(self._reserve_handle)
            self._reserve_handle = -1
            self._reserve_path.unlink(missing_ok=True)

    def close(self) -> None:
        """Bring the file to the disk and close it; safe to call twice."""
        self.release_room()
        if self._handle >= 0:
            handle, self._handle = self._handle, -1
            try:
                os.fsync(handle)
            finally:
                os.close(handle)

    # What a test replaces to play a full disk.

    def _write_some(self, data: memoryview) -> int:
        return os.write(self._handle, data)

    def _allocate(self, handle: int, size: int) -> None:
        os.posix_fallocate(handle, 0, size)

    def _cut_back(self) -> None:
        os.ftruncate(self._handle, self.size)
        os.lseek(self._handle, self.size, os.SEEK_SET)
