"""Signals written as a recording, message by message in the order of their stamps."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from engine_mount.recordings.metadata import units_text
from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.importing.channels import PREFIX, Channel
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.sources.uris import is_local, name_of, shown
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_text
from mount_ros.messages.cdr import string_message
from mount_ros.topics import SESSION

_BLOCK = 20_000_000_000  # ns, chosen: 20 s at 1 kHz are 7 MB of messages for each topic


def write_channels(
    folder: Path, channels: Sequence[Channel], session: dict[str, Any], progress: Callable[[float], None]
) -> None:
    """Write the recording `folder`; log times are the stamps. `progress` takes the share that is done."""
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    begin = min(int(channel.stamps[0]) for channel in channels)
    end = max(int(channel.stamps[-1]) for channel in channels)
    try:
        writer.add_topic(f'/{SESSION.name}', SESSION.type)
        for channel in channels:
            topic = channel.place.topic
            # of topics that every command takes the registry tells the unit
            units = {channel.place.field: channel.unit} if topic.name.startswith(PREFIX) else {}
            writer.add_topic(f'/{topic.name}', topic.type, details=units_text(units))
        writer.write(f'/{SESSION.name}', string_message(session_text(session)), begin)
        for first in range(begin, end + 1, _BLOCK):
            _write_block(writer, channels, first, first + _BLOCK)
            progress(min(1.0, (first + _BLOCK - begin) / (end + 1 - begin)))
    finally:
        writer.close()


def _write_block(writer: BagWriter, channels: Sequence[Channel], first: int, behind: int) -> None:
    """Write the messages from `first` on and before `behind` (ns)."""
    topics: list[str] = []
    messages: list[bytes] = []
    stamps = [np.zeros(0, np.int64)]
    for channel in channels:
        part = slice(*np.searchsorted(channel.stamps, [first, behind]))
        if part.start < part.stop:
            rows = channel.place.rows(channel.stamps[part], channel.values[part])
            topics += [f'/{channel.place.topic.name}'] * len(rows)
            messages += rows.view(f'V{rows.shape[1]}').ravel().tolist()
            stamps.append(channel.stamps[part])
    times = np.concatenate(stamps)
    for place in np.argsort(times, kind='stable').tolist():
        writer.write(topics[place], messages[place], int(times[place]))


Told = dict[str, Any]

SCENARIO = 'imported'
"""The scenario of such a recording, as its session tells it."""


def told_provenance(came: Provenance) -> Told:
    """Return what a session says of a file: its name, URI where it has one, hash, size, format, reader."""
    uri = {} if is_local(came.uri) else {'uri': shown(came.uri)}
    own = {'sha256': came.sha256, 'bytes': came.size, 'format': came.format, 'reader': came.reader}
    return {'file': name_of(came.uri), **uri, **own}


def told_mapping(mapping: Mapping, file: str = '') -> Told:
    """Return what a session says of the mapping: the file, the measuring system, times that were said."""
    times = {name: value for name, value in asdict(mapping.time).items() if value}
    told = {'file': PurePosixPath(file).name, 'system': mapping.system, 'time': times}
    return {name: value for name, value in told.items() if value}
