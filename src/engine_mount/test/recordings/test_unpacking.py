"""A few kilobytes that stand for gigabytes: no more is unpacked than the file states and than a limit."""

import tracemalloc

import lz4.frame
import pytest
import zstandard

from engine_mount.recordings.mcap_records import Chunk, unpacked

SIZE = 200 << 20
LIMIT = 64 << 20
ZEROS = bytes(1 << 20)


def packed(form):
    """200 MiB in some kilobytes."""
    if form == 'lz4':
        return lz4.frame.compress(bytes(SIZE), store_size=False)
    if form == 'zstd with its size':
        return zstandard.ZstdCompressor().compress(bytes(SIZE))
    packing = zstandard.ZstdCompressor().compressobj()  # a stream does not state its size
    return b''.join(packing.compress(ZEROS) for _ in range(SIZE // len(ZEROS))) + packing.flush()


@pytest.mark.parametrize('form', ['zstd', 'zstd with its size', 'lz4'])
@pytest.mark.parametrize('size', [1000, LIMIT])
def test_a_chunk_that_unpacks_to_more_is_refused_in_little_memory(form, size):
    content = packed(form)
    chunk = Chunk(0, 0, len(content), size, 0, form.split()[0], 0, 0)
    tracemalloc.start()
    assert unpacked(content, chunk) is None
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2.5 * LIMIT
