"""Messages of several chunks at once: those that the chunks hold one by one, in their order."""

import numpy as np
import pytest
from recorded_drive import write_drive

import engine_mount
from engine_mount.recordings.container.mcap_reading import chunks, mcap_file
from engine_mount.recordings.container.stored import HEAD, stored_messages
from engine_mount.recordings.messages.columns import stamps_in

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
    for wanted in (file.topics.keys(), list(file.topics)[1:2]):
        monkeypatch.setattr(mcap_file, '_AT_ONCE', size)
        found = messages(file.blocks(wanted))
        assert len(found) >= COUNT
        monkeypatch.setattr(mcap_file, 'proven_messages', lambda *of: None)
        assert found == messages(file.blocks(wanted))  # chunk by chunk
        monkeypatch.undo()


@pytest.mark.parametrize('damage', [8, 2**40, -1])
def test_message_indexes_that_lead_nowhere_are_not_believed(file, monkeypatch, damage):
    whole = messages(file.blocks(file.topics))
    entries = chunks._index_entries
    monkeypatch.setattr(chunks, '_index_entries', lambda data, position: entries(data, position) + damage)
    assert messages(file.blocks(file.topics)) == whole


def test_times_of_both_byte_orders_are_read():
    stamps = [(1_700_000_000, 5), (-3, 999_999_999)]
    raws = [
        bytes([0, kind, 0, 0])
        + np.array([second], f'{order}i4').tobytes()
        + np.array([rest], f'{order}u4').tobytes()
        for kind, order in ((1, '<'), (0, '>'))
        for second, rest in stamps
    ]
    found = stamps_in(stored_messages(np.zeros(4, HEAD), raws))
    assert found.tolist() == 2 * [second * 1_000_000_000 + rest for second, rest in stamps]
