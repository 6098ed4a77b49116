"""A few kilobytes that stand for gigabytes: no more is unpacked than is told, and no more than a limit."""

import mmap
import tracemalloc

import lz4.frame
import numpy as np
import pytest
import zstandard

from engine_mount.recordings.container.mcap_reading.chunks import Chunk, contents_of, left_out
from engine_mount.recordings.container.stored import HEAD, StorageError, stored_messages
from engine_mount.recordings.container.unpacking import (
    TooLargeError,
    mapped,
    plain,
    unpacked_zstd,
    unpacking_limit,
)

SIZE = 200 << 20
ZEROS = bytes(1 << 20)


@pytest.fixture(scope='module')
def stream():
    """200 MiB as a stream, which does not tell its size: some kilobytes."""
    packing = zstandard.ZstdCompressor().compressobj()
    packed = b''.join(packing.compress(ZEROS) for _ in range(SIZE // len(ZEROS))) + packing.flush()
    assert len(packed) < 30_000
    return packed


@pytest.fixture(scope='module')
def frame():
    """The same with its size told."""
    return zstandard.ZstdCompressor().compress(bytes(SIZE))


@pytest.fixture
def little_memory():
    tracemalloc.start()
    yield
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2.5 * unpacking_limit(0)


def chunk_of(file, packed, told, kind):
    """Return a chunk that tells of so many bytes, and the bytes of the file that holds no more."""
    file.write_bytes(packed)
    with file.open('rb') as opened:
        data = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
    return Chunk(0, 0, (len(packed),), told, 1, kind, 0, 0), data


def test_a_frame_within_its_limit_is_unpacked_whole_or_up_to_where_it_is_cut(stream, frame):
    assert unpacked_zstd(frame, SIZE) == (bytes(SIZE), True)
    found, whole = unpacked_zstd(stream[:-5], SIZE)
    assert (set(found), whole) == ({0}, False)


@pytest.mark.usefixtures('little_memory')
@pytest.mark.parametrize('kind', ['stream', 'frame'])
def test_what_unpacks_to_more_is_refused(kind, request):
    with pytest.raises(TooLargeError, match='67108864'):
        unpacked_zstd(request.getfixturevalue(kind), unpacking_limit(1000))


@pytest.mark.usefixtures('little_memory')
@pytest.mark.parametrize('told', [1000, SIZE])
def test_a_chunk_gives_no_more_than_it_tells_and_than_may_be(tmp_path, stream, told):
    chunk, data = chunk_of(tmp_path / 'file', stream, told, 'zstd')
    assert contents_of(data, chunk) is None
    assert ('tells of 209715200 bytes (limit 67108864' in left_out(chunk)) == (told == SIZE)


@pytest.mark.usefixtures('little_memory')
def test_a_chunk_of_lz4_gives_no_more_than_it_tells(tmp_path):
    packed = lz4.frame.compress(bytes(30 << 20), store_size=False)
    chunk, data = chunk_of(tmp_path / 'file', packed, 1000, 'lz4')
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    assert contents_of(data, chunk) is None
    assert tracemalloc.get_traced_memory()[1] - before < 1 << 20


@pytest.mark.usefixtures('little_memory')
def test_a_message_that_unpacks_to_more_stays_as_it_is(stream):
    messages = plain(stored_messages(np.zeros(1, HEAD), [stream]))
    assert [bytes(raw) for raw in messages.payloads()] == [stream]


def test_a_whole_file_that_unpacks_to_more_is_refused_with_the_way_out(tmp_path, stream):
    (tmp_path / 'bag.mcap.zstd').write_bytes(stream)
    with pytest.raises(
        StorageError, match=r'unpacks to more than 67108864 bytes .* unpack it by zstd or lz4 first'
    ):
        mapped(tmp_path / 'bag.mcap.zstd')
