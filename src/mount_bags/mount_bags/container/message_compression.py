"""Messages that rosbag2 compressed one by one (`compression_mode: message`), as they were before."""

from dataclasses import replace

import numpy as np
import zstandard

from mount_bags.container.chunks import LENGTH_BESIDES_PAYLOAD, MESSAGE_HEAD, Contents

_MAGIC = b'\x28\xb5\x2f\xfd'  # of zstd; a message in CDR begins with a zero


def plain(contents: Contents) -> Contents:
    """Return the same messages, those unpacked that are packed; one that cannot be stays as it is."""
    if not _has_packed(contents):
        return contents
    payloads = [_unpacked(bytes(raw)) for raw in contents.payloads()]
    heads = contents.heads.copy()
    heads['length'] = [LENGTH_BESIDES_PAYLOAD + len(payload) for payload in payloads]
    sizes = np.array([MESSAGE_HEAD.itemsize + len(payload) for payload in payloads])
    records = (head.tobytes() + payload for head, payload in zip(heads, payloads, strict=True))
    data = np.frombuffer(b''.join(records), np.uint8)
    return replace(contents, data=data, offsets=np.cumsum(sizes) - sizes, heads=heads)


def _has_packed(contents: Contents) -> bool:
    beginnings = contents.beginnings(len(_MAGIC))
    if beginnings is None:
        return any(bytes(raw[: len(_MAGIC)]) == _MAGIC for raw in contents.payloads())
    return bool((beginnings == np.frombuffer(_MAGIC, np.uint8)).all(axis=1).any())


def _unpacked(raw: bytes) -> bytes:
    if raw[: len(_MAGIC)] != _MAGIC:
        return raw
    unpacking = zstandard.ZstdDecompressor().decompressobj()
    try:
        unpacked = unpacking.decompress(raw)
    except (zstandard.ZstdError, MemoryError):
        return raw
    return unpacked if unpacking.eof else raw
