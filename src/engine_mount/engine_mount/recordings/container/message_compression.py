"""Messages that rosbag2 compressed one by one (`compression_mode: message`), as they were before."""

import numpy as np
import zstandard

from engine_mount.recordings.container.stored import StoredMessages, stored_messages
from engine_mount.recordings.container.unpacking import TooLargeError, unpacked_zstd, unpacking_limit

_MAGIC = b'\x28\xb5\x2f\xfd'  # of zstd; a message in CDR begins with a zero


def plain(messages: StoredMessages) -> StoredMessages:
    """Return the same messages, those unpacked that are packed; one that cannot be stays as it is."""
    if not _has_packed(messages):
        return messages
    return stored_messages(messages.heads, [_unpacked(bytes(raw)) for raw in messages.payloads()])


def _has_packed(messages: StoredMessages) -> bool:
    beginnings = messages.beginnings(len(_MAGIC))
    if beginnings is None:
        return any(bytes(raw[: len(_MAGIC)]) == _MAGIC for raw in messages.payloads())
    return bool((beginnings == np.frombuffer(_MAGIC, np.uint8)).all(axis=1).any())


def _unpacked(raw: bytes) -> bytes:
    if raw[: len(_MAGIC)] != _MAGIC:
        return raw
    try:
        unpacked, whole = unpacked_zstd(raw, unpacking_limit(len(raw)))
    except (zstandard.ZstdError, MemoryError, TooLargeError):
        return raw
    return unpacked if whole else raw
