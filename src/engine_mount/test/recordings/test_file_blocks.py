"""Messages of several chunks at once: those that the chunks hold one by one, in their order."""

import numpy as np
import pytest
from recorded_drive import write_drive

import engine_mount
from engine_mount.recordings.bag import file_blocks
from engine_mount.recordings.bag.file_blocks import blocks_of
from engine_mount.recordings.container.mcap_reading.mcap_file import McapFile
from engine_mount.recordings.container.mcap_reading.unpacker import Unpacker
from engine_mount.recordings.container.stored import HEAD, stored_messages
from engine_mount.recordings.messages.topic_times import _stamps_in

COUNT = 900


def messages(blocks):
    """Return number, times and bytes of all messages."""
    return [
        (*head.tolist(), bytes(raw))
        for block in blocks
        for head, raw in zip(block.heads, block.payloads(), strict=True)
    ]


@pytest.fixture
def file(tmp_path):
    (file,) = engine_mount.open(write_drive(tmp_path / 'drive', COUNT, chunk_size=4096)).files
    assert len(file.chunks) > 64
    return file


@pytest.mark.parametrize('size', [1, 20_000, 1 << 19])
def test_all_messages_of_the_wanted_topics_come_in_their_order(file, size, monkeypatch):
    monkeypatch.setattr(file_blocks, '_AT_ONCE', size)
    for wanted in (file.topics.keys(), list(file.topics)[1:2]):
        found = messages(blocks_of(file, wanted))
        assert len(found) >= COUNT
        assert found == messages(file.blocks(wanted))


def test_a_chunk_that_is_no_whole_records_is_read_as_far_as_it_goes(file, monkeypatch):
    whole = messages(file.blocks(file.topics))
    unpacked = Unpacker.unpacked

    def with_a_wrong_length(self, places):
        content, ends = unpacked(self, places)
        if len(places) > 3:
            content[ends[1] + 3] = 255  # of the first record of the third chunk
        return content, ends

    monkeypatch.setattr(Unpacker, 'unpacked', with_a_wrong_length)
    assert messages(blocks_of(file, file.topics)) == whole


@pytest.mark.parametrize('protected', [True, False])
def test_a_topic_that_its_chunks_prove_is_read_without_reading_the_file_through(
    tmp_path, monkeypatch, protected
):
    folder = write_drive(tmp_path / 'drive', COUNT)
    raws = list(engine_mount.open(folder)['coil_ripple'].payloads)
    recording, read_through = engine_mount.open(folder), []
    (file,) = recording.files
    if not protected:
        file.chunks.rows['crc'][-1] = 0  # as of a writer that makes none
    proof = McapFile.data_proof
    monkeypatch.setattr(McapFile, 'data_proof', lambda file: read_through.append(file) or proof(file))
    recording.load_alone(['coil_ripple'])
    assert list(recording['coil_ripple'].payloads) == raws
    assert bool(read_through) is not protected


def test_times_of_both_byte_orders_are_read():
    stamps = [(1_700_000_000, 5), (-3, 999_999_999)]
    raws = [
        bytes([0, kind, 0, 0])
        + np.array([second], f'{order}i4').tobytes()
        + np.array([rest], f'{order}u4').tobytes()
        for kind, order in ((1, '<'), (0, '>'))
        for second, rest in stamps
    ]
    found = _stamps_in(stored_messages(np.zeros(4, HEAD), raws))
    assert found.tolist() == 2 * [second * 1_000_000_000 + rest for second, rest in stamps]
