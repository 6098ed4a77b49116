"""Files as bytes in memory, those compressed as a whole included."""

import mmap
import os
import tempfile
from pathlib import Path
from typing import IO, Any

import zstandard

from engine_mount.recordings.container.unpacking import unpacking_limit

COMPRESSED_SUFFIXES = ('.zstd', '.zst', '.lz4')
_PIECE = 1 << 20  # bytes, chosen


class FileError(ValueError):
    """A file cannot be read at all; the text says why."""


def mapped(path: Path) -> mmap.mmap:
    """Return the bytes of a file, unpacked if its name ends in `.zstd`, `.zst` or `.lz4`."""
    try:
        with path.open('rb') as file:
            if path.suffix in COMPRESSED_SUFFIXES:
                with tempfile.TemporaryFile() as unpacked:
                    unpack(file, unpacked, path.suffix)
                    unpacked.flush()
                    return mmap.mmap(unpacked.fileno(), 0, access=mmap.ACCESS_READ)
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise FileError(f'{path} cannot be read: {error.strerror or error}') from None
    except FileError:
        raise
    except ValueError:
        raise FileError(f'{path} is empty') from None


def forget(data: mmap.mmap, begin: int, end: int) -> None:
    """Let the system take back the memory of a part of a file that was read; it is read anew where needed."""
    begin += -begin % mmap.PAGESIZE
    end = min(end, len(data))
    length = end - end % mmap.PAGESIZE - begin
    if length > 0:
        data.madvise(mmap.MADV_DONTNEED, begin, length)


def unpack(source: IO[bytes], target: IO[bytes], suffix: str) -> None:
    """Unpack `source`, packed as `suffix` says; what is cut off there is missing in `target`.

    Raises `FileError` where more comes of it than may.
    """
    size = os.fstat(source.fileno()).st_size
    limit = unpacking_limit(size)
    try:
        with _stream(source, suffix) as stream:
            while piece := stream.read(_PIECE):
                limit -= len(piece)
                if limit < 0:
                    raise FileError(
                        f'{source.name} unpacks to more than {unpacking_limit(size)} bytes (limit for {size} '
                        'packed bytes): if it is what you expect, unpack it by zstd or lz4 first'
                    )
                target.write(piece)
    except (zstandard.ZstdError, RuntimeError, EOFError):
        pass  # the file within tells where it ends


def _stream(source: IO[bytes], suffix: str) -> Any:
    if suffix == '.lz4':
        import lz4.frame

        return lz4.frame.open(source)
    return zstandard.ZstdDecompressor().stream_reader(source, read_across_frames=False, closefd=False)
