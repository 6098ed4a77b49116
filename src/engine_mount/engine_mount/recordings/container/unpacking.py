"""Compressed bytes unpacked within a limit: a few kilobytes of them can stand for gigabytes."""

import zstandard

_ALWAYS = 64 << 20  # bytes, chosen: sixteen times the usual chunk
_RATIO = 1000  # chosen: unpacked over packed beyond `_ALWAYS`; measured data reach some 100
_STEP = 1024  # bytes, chosen: of a stream at a time, which stand for 32 MiB at most


class TooLargeError(ValueError):
    """Packed bytes stand for more than may be unpacked; the text says how much may."""


def unpacking_limit(packed: int) -> int:
    """Return to how many bytes so many packed ones may unpack: 64 MiB, or 1000 times as many."""
    return max(_ALWAYS, _RATIO * packed)


def unpacked_zstd(packed: bytes, limit: int) -> tuple[bytes, bool]:
    """Return the unpacked bytes of a frame, no more than `limit`, and whether its end is there.

    Raises `zstandard.ZstdError` for damaged bytes, `TooLargeError` where there are more.
    """
    told = zstandard.frame_content_size(packed)
    if told > limit:
        raise TooLargeError(f'{told} bytes are told (limit {limit})')
    if told >= 0:
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=told), True
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
    return found
