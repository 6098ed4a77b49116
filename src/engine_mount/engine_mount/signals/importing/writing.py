"""Signals written as a recording, message by message in the order of their stamps."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.metadata import units_text
from engine_mount.signals.importing.topics import PREFIX, RecordedAs
from engine_mount.signals.signal import FloatArray
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_message, session_text
from mount_ros.topics import SESSION

Times = NDArray[np.int64]
_BLOCK = 20_000_000_000  # ns, chosen: 20 s at 1 kHz are 7 MB of messages for each topic


@dataclass(frozen=True, eq=False)
class Channel:
    """What is written under one topic: stamps (ns, rising) and values (n,) in the SI unit `unit`."""

    place: RecordedAs
    unit: str
    stamps: Times
    values: FloatArray


def write_channels(
    folder: Path,
    channels: Sequence[Channel],
    session: dict[str, Any],
    progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Write the recording `folder`; log times are the stamps. `progress` takes the share that is done."""
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    begin = min(int(channel.stamps[0]) for channel in channels)
    end = max(int(channel.stamps[-1]) for channel in channels)
    try:
        writer.add_topic(f'/{SESSION.name}', SESSION.type, latched=True)
        for channel in channels:
            place = channel.place
            # of topics that every command takes the registry tells the unit
            units = {place.field: channel.unit} if place.topic.name.startswith(PREFIX) else {}
            writer.add_topic(f'/{place.topic.name}', place.topic.type, details=units_text(units))
        writer.write(f'/{SESSION.name}', session_message(session_text(session)), begin)
        for first in range(begin, end + 1, _BLOCK):
            _write_block(writer, channels, first, first + _BLOCK)
            progress(min(1.0, (first + _BLOCK - begin) / (end + 1 - begin)))
    finally:
        writer.close()


@dataclass(frozen=True, eq=False)
class _Group:
    """Messages of topics that have the same stamps in a block."""

    names: Sequence[str]
    rows: Sequence[NDArray[np.uint8]]
    stamps: Times


def _write_block(writer: BagWriter, channels: Sequence[Channel], first: int, behind: int) -> None:
    """Write the messages from `first` on and before `behind` (ns)."""
    groups = _groups(channels, first, behind)
    if not groups:
        return
    stamps = np.concatenate([group.stamps for group in groups])
    owners = np.repeat(np.arange(len(groups)), [group.stamps.size for group in groups])
    order = np.argsort(stamps, kind='stable')
    places = np.concatenate([np.arange(group.stamps.size) for group in groups])[order]
    for begin, end in _runs(owners[order]):
        group = groups[int(owners[order[begin]])]
        part = slice(int(places[begin]), int(places[end - 1]) + 1)
        writer.write_columns(group.names, [rows[part] for rows in group.rows], group.stamps[part])


def _groups(channels: Sequence[Channel], first: int, behind: int) -> list[_Group]:
    """Return the messages of a block, those of topics with the same stamps together."""
    together: dict[bytes, list[tuple[Channel, slice]]] = {}
    for channel in channels:
        part = slice(*np.searchsorted(channel.stamps, [first, behind]).tolist())
        if part.start < part.stop:
            together.setdefault(channel.stamps[part].tobytes(), []).append((channel, part))
    return [
        _Group(
            [f'/{channel.place.topic.name}' for channel, _ in members],
            [channel.place.rows(channel.stamps[part], channel.values[part]) for channel, part in members],
            members[0][0].stamps[members[0][1]],
        )
        for members in together.values()
    ]


def _runs(owners: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    """Yield (begin, end) of the stretches of one owner."""
    changes = (np.flatnonzero(np.diff(owners)) + 1).tolist()
    yield from zip([0, *changes], [*changes, owners.size], strict=True)
