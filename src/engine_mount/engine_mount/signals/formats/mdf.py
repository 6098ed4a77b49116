"""MDF files of measurement systems (versions 3 and 4): each channel on the time base of its own group."""

import gc
import sys
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.can_frames import FRAME, NO_DATABASE, frames_in_mdf
from engine_mount.signals.formats.content import Content, Leaf, NoNumbersError, Stated, readable
from engine_mount.signals.formats.measured import TimeBase
from engine_mount.signals.signal import SECOND, FloatArray, SignalError, required

_FRAGMENT = 1 << 22  # B read at once, chosen: an hour at 1 kHz is read within 0.3 GB, and not slower
_DATED = 100_000_000  # s since 1970, chosen: an earlier start is a clock that was not set
_FRAMES = (FRAME, 'CAN_ErrorFrame', 'CAN_RemoteFrame', 'CAN_OverloadFrame')


def open_mdf(path: Path, stated: Stated) -> Content:
    """Return the channels of a recording of a measurement system; one in several groups is `group/name`."""
    asammdf = required('asammdf', 'reading MDF files')
    with path.open('rb') as stream:
        head = stream.read(68)
    if head[64:66] != b'HD' and head[64:68] != b'##HD':
        raise SignalError(
            f'{path} is no readable MDF file: byte 64 is {head[64:68].hex() or "missing"} where its '
            'header block begins with HD or ##HD; is it cut off, or another format?'
        )
    notes, reader = list[str](), 'asammdf'
    with readable(path, 'MDF file'), _silent_destructor():
        # By a stream, for a path would be mapped whole into memory; of a logger that never closed its file
        # asammdf completes a copy. Frames are decoded by the user's database, by one within the file only
        # where there is none.
        file = asammdf.MDF(
            path if head.startswith(b'UnFinMF') else path.open('rb'),
            raise_on_multiple_occurrences=False,
            process_bus_logging=stated.dbc is None,
        )
        file.configure(read_fragment_size=_FRAGMENT)
        seconds = file.start_time.timestamp()
        begin = round(seconds * SECOND) if seconds > _DATED else 0
        leaves = _leaves(file, path, begin, notes)
        raw = any(channel.name == FRAME for group in file.groups for channel in group.channels)
        if raw and stated.dbc is not None:
            leaves += frames_in_mdf(file, path, stated.dbc, notes).leaves(begin)
            reader = 'asammdf, cantools'
        elif raw and not leaves:
            raise SignalError(f'{path} holds raw CAN frames; {NO_DATABASE}')
        elif raw:
            notes.append('raw CAN frames are left out; --dbc names the database that decodes them')
    return Content(path, f'MDF {file.version}', reader, leaves, notes)


@contextmanager
def _silent_destructor() -> Iterator[None]:
    """Keep the destructor of a file that asammdf cannot open, which fails too, off the screen."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        yield
    except Exception as error:
        traceback.clear_frames(error.__traceback__)
        gc.collect()
        raise
    finally:
        sys.unraisablehook = hook


def _leaves(file: Any, path: Path, begin: int, notes: list[str]) -> list[Leaf]:
    """Return all channels but those of times, of frames, and parts of structures."""
    places = [
        (number, index, channel)
        for number, group in enumerate(file.groups)
        for index, channel in enumerate(group.channels)
        if index != file.masters_db.get(number) and channel.name and not channel.name.startswith(_FRAMES)
    ]
    counts = Counter(channel.name for _, _, channel in places)
    groups = {number: _group_name(file, number) for number, _, _ in places}

    @cache
    def clock(number: int) -> TimeBase:
        times = np.asarray(file.get_master(number), np.float64)
        return TimeBase(times, begin, f'times of group {groups[number]}')

    return [
        Leaf(
            channel.name if counts[channel.name] == 1 else f'{groups[number]}/{channel.name}',
            partial(_samples, file, path, number, index, notes),
            channel.unit or _unit_of_conversion(channel), channel.name, clock=partial(clock, number),
        )
        for number, index, channel in places
    ]  # fmt: skip


def _samples(file: Any, path: Path, number: int, index: int, notes: list[str]) -> FloatArray:
    """Return the samples of a channel with its conversion; invalid ones are NaN.

    Raises `SignalError` for a channel, or its times, that ends beyond the record.
    """
    group = file.groups[number]
    # asammdf itself would read on beyond the record
    size = int(group.channel_group.samples_byte_nr)
    for place in {index, file.masters_db.get(number, index)}:
        channel = group.channels[place]
        if hasattr(channel, 'start_offset'):  # version 3
            end = channel.start_offset + 8 * channel.additional_byte_offset + channel.bit_count
        else:
            end = 8 * channel.byte_offset + channel.bit_offset + channel.bit_count
        if size <= 0 or end > 8 * size:
            raise SignalError(
                f'{path}, channel {channel.name!r}: ends at bit {end} of a record of {size} '
                'bytes; the file is damaged, export it again'
            )
    name = group.channels[index].name
    # asammdf itself would leave out invalid samples, but not their times
    get = partial(file.get, group=number, index=index, ignore_invalidation_bits=True, samples_only=True)
    samples, invalid = get()
    if samples.dtype.kind in 'SUO':
        samples, invalid = get(raw=True)
        if samples.dtype.kind in 'fiub':
            notes.append(f'{name}: its conversion gives text, so its raw numbers are taken')
    if samples.dtype.kind not in 'fiub' or samples.ndim != 1:
        raise NoNumbersError(
            f'{path}, channel {name!r}: {samples.dtype} of shape {samples.shape} is no number for each '
            'sample; choose another channel'
        )
    if invalid is None:
        return np.asarray(samples, np.float64)
    return np.where(np.asarray(invalid, bool), np.nan, samples)


def _group_name(file: Any, number: int) -> str:
    group = getattr(file.groups[number], 'channel_group', None)
    name = getattr(group, 'acq_name', '') or getattr(group, 'comment', '')
    return name if name and '<' not in name and len(name) < 40 else str(number)


def _unit_of_conversion(channel: Any) -> str:
    conversion = getattr(channel, 'conversion', None)
    unit = getattr(conversion, 'unit', '') or getattr(conversion, 'unit_field', b'')
    return unit.decode('latin-1').strip('\x00 ') if isinstance(unit, bytes) else str(unit)
