"""A few kilobytes that stand for gigabytes: no more is unpacked than the file states and than a limit."""

import tracemalloc

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer
from recorded_drive import write_drive

import engine_mount
from engine_mount.recordings import ReadingError
from engine_mount.recordings.stored import HEAD, stored_messages
from engine_mount.recordings.unpacking import plain, unpacked, unpacking_limit

SIZE = 200 << 20
ZEROS = bytes(1 << 20)


@pytest.fixture(scope='module')
def stream():
    """200 MiB as a stream, which does not state its size: some kilobytes."""
    packing = zstandard.ZstdCompressor().compressobj()
    packed = b''.join(packing.compress(ZEROS) for _ in range(SIZE // len(ZEROS))) + packing.flush()
    assert len(packed) < 30_000
    return packed


@pytest.fixture
def packed(request, stream):
    """The same bytes in several forms."""
    if request.param == 'lz4':
        return lz4.frame.compress(bytes(SIZE), store_size=False)
    return stream if request.param == 'zstd' else zstandard.ZstdCompressor().compress(bytes(SIZE))


@pytest.fixture
def little_memory():
    tracemalloc.start()
    yield
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2.5 * unpacking_limit(0)


@pytest.mark.parametrize('packed', ['zstd', 'zstd with its size', 'lz4'], indirect=True)
@pytest.mark.parametrize('limit', [1000, 64 << 20])
def test_bytes_that_unpack_to_more_are_refused(packed, limit, request, little_memory):
    kind = 'lz4' if packed[:1] == b'\x04' else 'zstd'
    assert unpacked(packed, kind, limit) is None


def test_bytes_within_the_limit_are_unpacked(stream):
    assert unpacked(stream, 'zstd', SIZE) == bytes(SIZE)


def test_a_message_that_unpacks_to_more_stays_as_it_is(stream, little_memory):
    messages = plain(stored_messages(np.zeros(1, HEAD), [stream]))
    assert [bytes(raw) for raw in messages.payloads()] == [stream]


def test_a_chunk_that_claims_too_much_is_left_out_with_the_way_out(tmp_path):
    path = tmp_path / 'large.mcap'
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=1 << 30, compression=CompressionType.ZSTD)
        writer.start('ros2', 'another')
        writer.register_channel('/text', 'cdr', writer.register_schema('a/msg/B', 'ros2msg', b'string data'))
        writer.add_message(1, 0, bytes(SIZE), 0)
        writer.finish()
    recording = engine_mount.open(path)
    assert not len(recording['text'])
    assert any(
        'claims 2097' in warning and 'limit 67108864' in warning and 'write smaller chunks' in warning
        for warning in recording.warnings
    )


def test_a_whole_file_packed_by_zstd_is_read(tmp_path):
    content = (write_drive(tmp_path / 'drive', 5) / 'drive_0.mcap').read_bytes()
    (tmp_path / 'bag.mcap.zstd').write_bytes(zstandard.ZstdCompressor().compress(content))
    assert len(engine_mount.open(tmp_path / 'bag.mcap.zstd')['displacement']) == 5


def test_a_whole_file_that_unpacks_to_more_is_refused_with_the_way_out(tmp_path, stream):
    (tmp_path / 'bag.mcap.zstd').write_bytes(stream)
    with pytest.raises(ReadingError, match=r'unpacks to more than 67108864 bytes .* unpack it by zstd first'):
        engine_mount.open(tmp_path / 'bag.mcap.zstd')
