"""Messages of several chunks at once: those that the chunks hold one by one, in their order."""

import struct

import numpy as np
import pytest
from mcap.opcode import Opcode
from recorded_drive import COIL_RIPPLE, RECORDED, sample, write_drive

import engine_mount
from engine_mount.recordings import mcap_file

COUNT = 900


@pytest.mark.parametrize('size', [1, 20_000, 1 << 19])
@pytest.mark.parametrize('damage', [None, 8, 1 << 40, -1])
def test_all_messages_come_in_their_order_whatever_the_message_indexes_say(
    tmp_path, size, damage, monkeypatch
):
    monkeypatch.setattr(mcap_file, '_AT_ONCE', size)
    folder = write_drive(tmp_path / 'drive', COUNT, chunk_size=4096)
    if damage is not None:
        spoil_indexes(folder / 'drive_0.mcap', damage)
    (file,) = engine_mount.open(folder).files
    assert len(file.chunks) > 64
    for topics in (RECORDED, (COIL_RIPPLE,)):
        numbers = [
            number for number, topic in file.topics.items() if topic.name[1:] in {t.name for t in topics}
        ]
        found = [bytes(raw) for block in file.blocks(numbers) for raw in block.payloads()]
        assert found == [sample(topic, index) for index in range(COUNT) for topic in topics]
    assert bool(file.warnings) == (damage is not None)


def spoil_indexes(path, damage):
    """Move the offsets in all message indexes."""
    content, position = bytearray(path.read_bytes()), 8
    while position < len(content) - 8:
        opcode, length = struct.unpack_from('<BQ', content, position)
        if opcode == Opcode.MESSAGE_INDEX:
            entries = np.frombuffer(content, '<i8', (length - 6) // 8, position + 15)
            entries[1::2] += damage
            del entries
        position += 9 + length
    path.write_bytes(content)
