"""MDF files of measurement systems (versions 3 and 4): each channel on the time base of its own group."""

from collections import Counter
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.extras import required
from engine_mount.signals.formats.can_frames import FRAME, frames_in_mdf
from engine_mount.signals.formats.content import Content, Leaf, Stated, readable
from engine_mount.signals.formats.measured import FloatArray, TimeBase
from engine_mount.signals.signal import SECOND, SignalError

_FRAGMENT = 1 << 22  # B read at once, chosen: an hour at 1 kHz is read within 0.3 GB, and not slower
_DATED = 100_000_000  # s since 1970, chosen: an earlier start is a clock that was not set
_FRAMES = (FRAME, 'CAN_ErrorFrame', 'CAN_RemoteFrame', 'CAN_OverloadFrame')


def open_mdf(path: Path, stated: Stated) -> Content:
    """Return the channels of a recording of a measurement system; one in several groups is `group/name`."""
    asammdf = required('asammdf', 'reading MDF files')
    _check_head(path)
    notes: list[str] = []
    with readable(path, 'MDF file'):
        # by a stream: a path would be mapped whole into memory
        # frames are decoded by the user's database, by one within the file only where there is none
        file = asammdf.MDF(
            path.open('rb'), raise_on_multiple_occurrences=False, process_bus_logging=stated.dbc is None
        )
        file.configure(read_fragment_size=_FRAGMENT)
        leaves = _leaves(file, path, notes)
        raw = any(channel.name == FRAME for group in file.groups for channel in group.channels)
        frames = frames_in_mdf(file, path, stated.dbc, notes) if raw and stated.dbc is not None else None
    reader, own, prepare = 'asammdf', len(leaves), None
    if frames is not None:
        reader = 'asammdf, cantools'
        decoded, prepare = frames.leaves(_begin(file))
        leaves += decoded
    elif raw and not leaves:
        raise SignalError(
            f'{path} holds raw CAN frames; name the database that decodes them with --dbc, as .dbc or .kcd'
        )
    elif raw:
        notes.append('raw CAN frames are left out; --dbc names the database that decodes them')

    def decode(numbers: Sequence[int]) -> None:
        if prepare is not None:
            prepare([number - own for number in numbers if number >= own])

    return Content(path, f'MDF {file.version}', reader, leaves, notes, decode)


def _leaves(file: Any, path: Path, notes: list[str]) -> list[Leaf]:
    """Return all channels but those of times, of frames, and parts of structures."""
    places = [
        (number, index, channel)
        for number, group in enumerate(file.groups)
        for index, channel in enumerate(group.channels)
        if index != file.masters_db.get(number) and channel.name and not channel.name.startswith(_FRAMES)
    ]
    counts = Counter(channel.name for _, _, channel in places)
    groups = {number: _group_name(file, number) for number, _, _ in places}
    clocks = {
        number: cache(partial(_clock, file, number, f'times of group {name}'))
        for number, name in groups.items()
    }
    return [
        Leaf(
            channel.name if counts[channel.name] == 1 else f'{groups[number]}/{channel.name}',
            partial(_samples, file, path, number, index, notes),
            channel.unit or _unit_of_conversion(channel),
            channel.name,
            clock=clocks[number],
        )
        for number, index, channel in places
    ]


def _clock(file: Any, number: int, told: str) -> TimeBase:
    return TimeBase(np.asarray(file.get_master(number), np.float64), _begin(file), told)


def _samples(file: Any, path: Path, number: int, index: int, notes: list[str]) -> FloatArray:
    """Return the samples of a channel with its conversion; invalid ones are NaN."""
    _check_places(file, path, number, index)
    name = file.groups[number].channels[index].name
    signal = file.get(group=number, index=index, ignore_invalidation_bits=False)
    if signal.samples.dtype.kind in 'SUO':
        signal = file.get(group=number, index=index, raw=True, ignore_invalidation_bits=False)
        notes.append(f'{name}: its conversion gives text, so its raw numbers are taken')
    samples = signal.samples
    if samples.dtype.kind not in 'fiub' or samples.ndim != 1:
        raise SignalError(
            f'{path}, channel {name!r}: {samples.dtype} of shape {samples.shape} is no number for each '
            'sample; choose another channel'
        )
    values = np.array(np.ma.filled(np.ma.asarray(samples, np.float64), np.nan))
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, bool)] = np.nan
    return values


def _check_places(file: Any, path: Path, number: int, index: int) -> None:
    """Raise `SignalError` for a channel, or its times, beyond the record, where asammdf reads on."""
    group = file.groups[number]
    master = file.masters_db.get(number)
    size = int(group.channel_group.samples_byte_nr)
    for place in (index, *([] if master is None else [master])):
        channel = group.channels[place]
        if size <= 0 or _end_of(channel) > 8 * size:
            raise SignalError(
                f'{path}, channel {channel.name!r}: ends at bit {_end_of(channel)} of a record of {size} '
                'bytes; the file is damaged, export it again'
            )


def _check_head(path: Path) -> None:
    """Raise `SignalError` where the header block does not follow the identification of 64 bytes."""
    with path.open('rb') as file:
        head = file.read(68)
    if head[64:66] != b'HD' and head[64:68] != b'##HD':
        raise SignalError(
            f'{path} is no readable MDF file: byte 64 is {head[64:68].hex() or "missing"} where its '
            'header block begins with HD or ##HD; is it cut off, or another format?'
        )


def _end_of(channel: Any) -> int:
    """Return the bit behind a channel in its record."""
    if hasattr(channel, 'start_offset'):  # version 3
        return int(channel.start_offset + 8 * channel.additional_byte_offset + channel.bit_count)
    return int(8 * channel.byte_offset + channel.bit_offset + channel.bit_count)


def _group_name(file: Any, number: int) -> str:
    group = getattr(file.groups[number], 'channel_group', None)
    name = getattr(group, 'acq_name', '') or getattr(group, 'comment', '')
    return name if name and '<' not in name and len(name) < 40 else str(number)


def _unit_of_conversion(channel: Any) -> str:
    conversion = getattr(channel, 'conversion', None)
    unit = getattr(conversion, 'unit', '') or getattr(conversion, 'unit_field', b'')
    return unit.decode('latin-1').strip('\x00 ') if isinstance(unit, bytes) else str(unit)


def _begin(file: Any) -> int:
    """Return when the times of the file begin in ns since 1970, 0 where its clock was not set."""
    seconds = file.start_time.timestamp()
    return round(seconds * SECOND) if seconds > _DATED else 0
