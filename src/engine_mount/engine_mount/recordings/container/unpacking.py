"""Compressed bytes unpacked within a limit: a few kilobytes of them can stand for gigabytes."""

import mmap
import os
import tempfile
from pathlib import Path
from typing import IO

import zstandard

from engine_mount.recordings.container.stored import StorageError, StoredMessages, stored_messages

COMPRESSED_SUFFIXES = ('.zstd', '.zst', '.lz4')
_ALWAYS = 64 << 20  # bytes, chosen: sixteen times the usual chunk
_RATIO = 1000  # chosen: unpacked over packed beyond `_ALWAYS`; measured data reach some 100
_STEP = 1024  # bytes, chosen: of a stream at a time, which stand for 32 MiB at most
_PIECE = 1 << 20  # bytes, chosen
_MAGIC = b'\x28\xb5\x2f\xfd'  # of zstd; a message in CDR begins with a zero


class TooLargeError(ValueError):
    """Packed bytes stand for more than may be unpacked; the text says how much may."""


def unpacking_limit(packed: int) -> int:
    """Return to how many bytes so many packed ones may unpack: 64 MiB, or 1000 times as many."""
    return max(_ALWAYS, _RATIO * packed)


def unpacked_zstd(packed: bytes, limit: int) -> tuple[bytes, bool]:
    """Return the unpacked bytes of a frame, no more than `limit`, and whether its end is there.

    Raises `zstandard.ZstdError` for damaged bytes, `TooLargeError` where there are more.
    """
    size = zstandard.frame_content_size(packed)
    if size > limit:
        raise TooLargeError(f'{size} bytes are told (limit {limit})')
    if size >= 0:
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size), True
    unpacking = zstandard.ZstdDecompressor().decompressobj()
    found = bytearray()
    for begin in range(0, len(packed), _STEP):
        found += unpacking.decompress(packed[begin : begin + _STEP])
        if len(found) > limit:
            raise TooLargeError(f'more than {limit} bytes (limit) come of {len(packed)}')
        if unpacking.eof:
            break
    return bytes(found), unpacking.eof


def unpacked_lz4(packed: bytes, limit: int) -> bytes:
    """Return the unpacked bytes of a frame; raises `RuntimeError` for damage, `TooLargeError` for more."""
    import lz4.frame  # other writers use it, this project does not

    found = lz4.frame.LZ4FrameDecompressor().decompress(packed, limit + 1)
    if len(found) > limit:
        raise TooLargeError(f'more than {limit} bytes (limit) come of {len(packed)}')
    return bytes(found)


def plain(messages: StoredMessages) -> StoredMessages:
    """Return the messages, those unpacked that rosbag2 packed one by one (`compression_mode: message`).

    One that cannot be unpacked stays as it is.
    """
    places = messages.begins[messages.ends - messages.begins >= len(_MAGIC)]
    if not (messages.data[places] == _MAGIC[0]).any():
        return messages
    return stored_messages(messages.heads, [_plain(bytes(raw)) for raw in messages.payloads()])


def mapped(path: Path) -> mmap.mmap:
    """Return the bytes of a file, unpacked if its name ends in `.zstd`, `.zst` or `.lz4`.

    Raises `StorageError`.
    """
    try:
        with path.open('rb') as file:
            if path.suffix not in COMPRESSED_SUFFIXES:
                return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            with tempfile.TemporaryFile() as unpacked:
                unpack(file, unpacked, path.suffix)
                unpacked.flush()
                return mmap.mmap(unpacked.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise StorageError(f'{path} cannot be read: {error.strerror or error}') from None
    except StorageError:
        raise
    except ValueError:
        raise StorageError(f'{path} is empty') from None


def release(data: mmap.mmap) -> None:
    """Let the system take back the memory of a file's bytes; they are read anew where needed."""
    data.madvise(mmap.MADV_DONTNEED)


def unpack(source: IO[bytes], target: IO[bytes], suffix: str) -> None:
    """Unpack `source`, packed as `suffix` says; what is cut off there is missing in `target`.

    Raises `StorageError` where more comes of it than may.
    """
    size = os.fstat(source.fileno()).st_size
    limit = unpacking_limit(size)
    try:
        if suffix == '.lz4':
            import lz4.frame

            stream = lz4.frame.open(source)
        else:
            stream = zstandard.ZstdDecompressor().stream_reader(source, closefd=False)
        while piece := stream.read(_PIECE):
            limit -= len(piece)
            if limit < 0:
                raise StorageError(
                    f'{source.name} unpacks to more than {unpacking_limit(size)} bytes (limit for {size} '
                    'packed bytes): if it is what you expect, unpack it by zstd or lz4 first'
                )
            target.write(piece)
    except (zstandard.ZstdError, RuntimeError, EOFError):
        pass  # the file within tells where it ends


def _plain(raw: bytes) -> bytes:
    if raw[: len(_MAGIC)] != _MAGIC:
        return raw
    try:
        unpacked, whole = unpacked_zstd(raw, unpacking_limit(len(raw)))
    except (zstandard.ZstdError, MemoryError, TooLargeError):
        return raw
    return unpacked if whole else raw
