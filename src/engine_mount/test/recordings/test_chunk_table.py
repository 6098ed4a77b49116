"""The table of a file's chunks: what all index records tell at once is what each of them tells alone."""

import random
import struct

import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import ChunkIndex

from engine_mount.recordings.container.mcap_reading.chunk_index import can_be_there, indexed_chunks
from engine_mount.recordings.container.mcap_reading.chunk_table import chunk_table, joined
from engine_mount.recordings.container.mcap_reading.chunks import SHORTEST_CHUNK, Chunk
from engine_mount.recordings.container.mcap_reading.unpacker import Unpacker

HEAD = 9  # bytes of a record: opcode and length
SIZES = 56  # byte of a record at which the length of its compression's name stands, without channels


def index(position, channels, compression='zstd', **further):
    told = {
        'chunk_length': SHORTEST_CHUNK + 200,
        'chunk_start_offset': position,
        'compressed_size': 150,
        'compression': compression,
        'message_end_time': position + 7,
        'message_index_length': 40,
        'message_index_offsets': dict.fromkeys(channels, position + 300),
        'message_start_time': position + 3,
        'uncompressed_size': 900,
    }
    return ChunkIndex(**{**told, **further})


def written(indexes):
    """Return the records as bytes in a row, and where the content of each begins and ends."""
    parts = []
    for each in indexes:
        builder = RecordBuilder()
        each.write(builder)
        parts.append(builder.end())
    ends = np.cumsum([len(part) for part in parts])
    begins = ends - [len(part) for part in parts] + HEAD
    return b''.join(parts), begins, ends


def table_of(indexes):
    content, begins, ends = written(indexes)
    return indexed_chunks(np.frombuffer(content, np.uint8), begins, ends)


def chunk_of(index):
    end = index.chunk_start_offset + index.chunk_length
    return Chunk(
        position=index.chunk_start_offset,
        begin=end - index.compressed_size,
        ends=(end,),
        size=index.uncompressed_size,
        crc=0,
        compression=index.compression,
        start_time=index.message_start_time,
        end_time=index.message_end_time,
        index_length=index.message_index_length,
        channels=frozenset(index.message_index_offsets) if index.message_index_length else None,
    )


def test_tables_of_parts_are_joined_in_the_order_of_their_positions():
    indexes = [
        *(index(5000 + 400 * place, [place % 3], 'zstd' if place % 2 else '') for place in range(7)),
        *(index(400 * place, [7, 2], message_index_length=40 * place) for place in range(5)),
    ]
    parts = [table_of(indexes[:4]), table_of([]), table_of(indexes[4:])]
    assert list(joined(parts)) == list(table_of(indexes))
    assert len(joined(parts).kinds) == len(table_of(indexes).kinds)
    assert not len(joined([]))


def test_records_of_any_layout_tell_of_the_chunks_as_one_by_one():
    random.seed(4)
    indexes = [
        index(
            100_000 - 1000 * place,  # in the order of the file they stand the other way round
            random.sample([0, 1, 2, 255, 256, 40_000], random.randrange(4)),
            random.choice(['', 'zstd', 'lz4', 'unknown']),
            message_index_length=random.choice([0, 40]),
            message_end_time=random.choice([0, 2**64 - 1]),
        )
        for place in range(60)
    ]
    table = table_of(indexes)
    assert list(table) == [chunk_of(each) for each in reversed(indexes)]


def test_chunks_are_found_by_the_channels_that_they_hold():
    table = table_of(
        [
            index(100, [1, 2]),
            index(600, [2, 1]),
            index(1100, [3]),
            index(1600, []),
            index(2100, [1], message_index_length=0),
        ]
    )
    assert table.holding([1]).tolist() == [0, 1, 4]  # of the last one it is not known
    assert table.holding([9]).tolist() == [4]
    assert not table.plain
    assert len({table[0].channels, table[1].channels}) == 1


def test_a_chunk_without_messages_tells_no_time():
    empty = index(600, [], message_start_time=0, message_end_time=0)
    assert table_of([index(100, [1]), empty]).times == (103, 107)
    assert table_of([empty]).times is None
    assert table_of([index(100, [], message_index_length=0)]).times == (103, 107)
    assert table_of([]).times is None


@pytest.mark.parametrize(
    'damage',
    [
        lambda content: content[:-1],  # the sizes are not whole
        lambda content: content[:40],
        lambda content: content[:HEAD],
        lambda content: content[:41] + struct.pack('<I', 10**9) + content[45:],  # more offsets than bytes
        lambda content: content[:41] + struct.pack('<I', 7) + content[45:],  # no whole number of them
        lambda content: content[:SIZES] + struct.pack('<I', 2**32 - 1) + content[SIZES + 4 :],  # of the name
        lambda content: content.replace(b'zstd', b'\xff\xfe\xff\xff'),  # no text
    ],
)
def test_a_record_that_is_not_readable_makes_all_unreadable(damage):
    sound, *_ = written([index(100, [1])])
    content, begins, ends = written([index(600, [])])
    damaged = damage(content)
    assert content[0] == Opcode.CHUNK_INDEX
    data = np.frombuffer(sound + damaged, np.uint8)
    first, last = len(sound), len(sound) + len(damaged)
    assert indexed_chunks(data, np.array([HEAD, first + HEAD]), np.array([first, last])) is None
    assert indexed_chunks(np.frombuffer(content, np.uint8), begins, ends) is not None


@pytest.mark.parametrize(
    'told',
    [
        {'chunk_start_offset': 2**64 - 1},
        {'chunk_length': 2**64 - 1},
        {'chunk_length': SHORTEST_CHUNK + 149},
        {'compressed_size': 2**64 - 1},
        {'uncompressed_size': 2**32 + 1},
    ],
)
def test_a_chunk_that_the_file_has_no_room_for_is_not_believed(told):
    assert can_be_there(table_of([index(100, [1])]), 100 + SHORTEST_CHUNK + 200)
    assert not can_be_there(table_of([index(100, [1])]), 100 + SHORTEST_CHUNK + 199)
    assert not can_be_there(table_of([index(100, [1], **told)]), 1 << 40)


def test_chunks_that_are_known_one_by_one_are_the_same_in_a_table():
    chunks = [chunk_of(index(100, [1, 2])), chunk_of(index(600, [2])), chunk_of(index(1100, [1, 2]))]
    chunks[1].crc, chunks[2].size = 17, 0
    table = chunk_table(chunks)
    assert list(table) == chunks
    assert table[-1] == chunks[-1]
    assert table[1:] == chunks[1:]
    assert table.unprotected == 1
    with pytest.raises(IndexError):
        table[3]


def unpacked(contents, sizes, compressions):
    """Return what is unpacked of chunks whose heads tell these sizes."""
    packs = [
        zstandard.compress(each) if kind else each for each, kind in zip(contents, compressions, strict=True)
    ]
    ends = np.cumsum([len(pack) for pack in packs]).tolist()
    chunks = [
        Chunk(0, end - len(pack), (end,), size, 0, kind, 0, 0)
        for pack, end, size, kind in zip(packs, ends, sizes, compressions, strict=True)
    ]
    unpacker = Unpacker(b''.join(packs), chunk_table(chunks))
    unpacker.unpacked(np.arange(1))  # what is left of it must not be seen
    data, ends = unpacker.unpacked(np.arange(len(chunks)))
    return [data[begin:end].tobytes() for begin, end in zip([0, *ends], ends, strict=False)]


def test_chunks_are_unpacked_in_a_row():
    contents = [b'a' * 1000, b'', b'b' * 10, b'c' * 3000]
    assert unpacked(contents, [1000, 0, 10, 3000], ['zstd', 'zstd', '', 'zstd']) == contents


@pytest.mark.parametrize('told', [0, 9, 11, 5000])
@pytest.mark.parametrize('compression', ['', 'zstd'])
def test_a_chunk_that_is_not_as_long_as_its_head_tells_is_not_unpacked(told, compression):
    contents = [b'a' * 1000, b'b' * 10, b'c' * 3000]
    assert unpacked(contents, [1000, told, 3000], ['zstd', compression, 'zstd']) == contents[:1]


def test_what_is_not_packed_as_told_is_not_unpacked():
    packed = zstandard.compress(b'b' * 10)
    data = bytes(4) + packed[4:]
    table = chunk_table([Chunk(0, 0, (len(data),), 10, 0, 'zstd', 0, 0)])
    assert len(Unpacker(data, table).unpacked(np.arange(1))[1]) == 0


def test_a_damaged_time_below_0_is_one_without_a_sign():
    table = chunk_table([Chunk(0, SHORTEST_CHUNK, (200,), 10, 0, '', -1, -1, 0, frozenset({1}))])
    assert table.times == (2**64 - 1, 2**64 - 1)


def test_the_gaps_of_a_table_are_before_each_chunk_and_behind_the_last():
    chunks = [Chunk(place, place + 50, (place + 60,), 1, 0, '', 1, 1, 15, None) for place in (20, 95, 200)]
    for count, gaps in ((3, [(8, 20), (95, 95), (170, 200), (275, 400)]), (0, [(8, 400)])):
        begins, ends = chunk_table(chunks[:count]).gaps(8, 400)
        assert list(zip(begins.tolist(), ends.tolist(), strict=True)) == gaps
