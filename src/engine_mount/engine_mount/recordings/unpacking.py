"""Compressed bytes unpacked within a limit: a few kilobytes of them can stand for gigabytes."""

import contextlib
from pathlib import Path

import zstandard

from engine_mount.recordings.stored import StorageError, StoredMessages, stored_messages

COMPRESSED_SUFFIXES = ('.zstd', '.zst')
_ALWAYS = 64 << 20  # bytes, chosen: sixteen times the usual chunk
_RATIO = 1000  # chosen: unpacked over packed beyond `_ALWAYS`; measured data reach some 100
_PIECE = 1 << 20  # bytes, chosen
_MAGIC = b'\x28\xb5\x2f\xfd'  # of zstd; a message in CDR begins with a zero


def unpacking_limit(packed: int) -> int:
    """Return to how many bytes so many packed ones may unpack: 64 MiB, or 1000 times as many."""
    return max(_ALWAYS, _RATIO * packed)


def unpacked(packed: bytes, compression: str, limit: int) -> bytes | None:
    """Return the unpacked bytes, None if they are damaged or more than `limit`."""
    try:
        if compression == 'zstd':
            size = zstandard.frame_content_size(packed)
            if size > limit:
                return None
            unpacking = zstandard.ZstdDecompressor()
            found = (
                unpacking.decompress(packed) if size >= 0 else unpacking.stream_reader(packed).read(limit + 1)
            )
        elif compression == 'lz4':
            import lz4.frame  # other writers use it, this project does not

            found = lz4.frame.LZ4FrameDecompressor().decompress(packed, limit + 1)
        elif compression:
            return None
        else:
            found = packed
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError):
        return None
    return found if len(found) <= limit else None


def plain(messages: StoredMessages) -> StoredMessages:
    """Return the messages, those unpacked that rosbag2 packed one by one (`compression_mode: message`).

    One that cannot be unpacked stays as it is.
    """
    places = messages.begins[messages.ends - messages.begins >= len(_MAGIC)]
    if not (messages.data[places] == _MAGIC[0]).any():
        return messages
    return stored_messages(messages.heads, [_plain(bytes(raw)) for raw in messages.payloads()])


def unpack(path: Path, target: Path) -> None:
    """Unpack a file; what is cut off there is missing in `target`.

    Raises `StorageError` where it unpacks to more than its limit.
    """
    size = path.stat().st_size
    limit = unpacking_limit(size)
    with path.open('rb') as source, target.open('wb') as written, contextlib.suppress(zstandard.ZstdError):
        # where it ends too early, the file within shows it
        for piece in zstandard.ZstdDecompressor().read_to_iter(source, write_size=_PIECE):
            limit -= len(piece)
            if limit < 0:
                raise StorageError(
                    f'{path} unpacks to more than {unpacking_limit(size)} bytes (limit for {size} '
                    'packed bytes): if it is what you expect, unpack it by zstd first'
                )
            written.write(piece)


def _plain(raw: bytes) -> bytes:
    if raw[: len(_MAGIC)] != _MAGIC:
        return raw
    found = unpacked(raw, 'zstd', unpacking_limit(len(raw)))
    return raw if found is None else found
