"""The messages of a file, those of several chunks together: a long recording has very many small ones."""

from collections.abc import Callable, Collection, Iterator

import numpy as np

from engine_mount.recordings.container.mcap_reading.chunk_table import Places
from engine_mount.recordings.container.mcap_reading.chunks import messages_at
from engine_mount.recordings.container.mcap_reading.mcap_file import McapFile
from engine_mount.recordings.container.message_compression import plain
from engine_mount.recordings.container.stored import StoredFile, StoredMessages

Blocks = Callable[[StoredFile, Collection[int]], Iterator[StoredMessages]]
"""What yields the messages of some topics in the order of a file."""

_AT_ONCE = 1 << 19  # bytes of chunks that are unpacked together, chosen: they stay in the processor's cache
_FEW = 64  # chunks, chosen: for so few the compiled walk through their records is not worth loading
_CHANNELS = 1 << 16  # numbers that a channel can have


def blocks_of(file: StoredFile, topics: Collection[int]) -> Iterator[StoredMessages]:
    """Yield the messages of `topics` in the order of the file; their bytes hold until the next block."""
    if isinstance(file, McapFile) and len(file.chunks.holding(topics)) > _FEW and file.plain:
        yield from _together(file, topics)
    else:
        yield from file.blocks(topics)


def are_vouched(file: StoredFile, topics: Collection[int]) -> bool:
    """Return whether the messages of `topics` can be read by `vouched_blocks`."""
    if not isinstance(file, McapFile) or not file.proven or file.has_loose_messages:
        return False
    return bool(file.chunks.rows['crc'][file.chunks.holding(topics)].all())


def vouched_blocks(file: StoredFile, topics: Collection[int]) -> Iterator[StoredMessages]:
    """Yield the messages of `topics` that the checksums of their own chunks vouch for.

    The file is not read through for that of its data section, as `blocks_of` does.
    """
    assert isinstance(file, McapFile)
    wanted = np.array(sorted(topics), np.int64)
    for place in file.chunks.holding(topics).tolist():
        yield from file.messages_in(place, wanted)


def unpacked_together(file: McapFile, places: Places) -> Iterator[Places]:
    """Yield numbers of chunks that stand near together and unpack into some `_AT_ONCE` bytes."""
    for near in file.passing(places):
        before = np.cumsum(file.chunks.rows['size'][near])
        yield from np.split(near, np.flatnonzero(np.diff(before // _AT_ONCE)) + 1)


def _together(file: McapFile, topics: Collection[int]) -> Iterator[StoredMessages]:
    from engine_mount.recordings.messages.taken import find  # what is compiled takes long to load

    numbers = np.array(sorted(topics), np.int64)
    wanted = np.zeros(_CHANNELS, np.bool_)
    wanted[numbers] = True
    unpacker = file.unpacker()
    for places in unpacked_together(file, file.chunks.holding(topics)):
        while len(places):
            content, ends = unpacker.unpacked(places)
            taken, begins = find(content, ends, wanted)
            if len(begins):
                yield plain(messages_at(content, begins))
            if taken < len(places):  # these are no whole records
                yield from file.messages_in(int(places[taken]), numbers)
                taken += 1
            places = places[taken:]
