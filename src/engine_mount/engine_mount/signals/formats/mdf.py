"""MDF files of measurement systems (versions 3 and 4): each channel on the time base of its own group."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.extras import required
from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.can.frames import DecodedFrames
from engine_mount.signals.formats.can.in_mdf import FRAME, OTHER_FRAMES, frames_in_mdf
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase, unique
from engine_mount.signals.signal import SignalError

_SECOND = 1_000_000_000  # ns
_FRAGMENT = 1 << 22  # B read at once, chosen: an hour at 1 kHz is read within 0.3 GB, and not slower
_DATED = 100_000_000  # s since 1970, chosen: an earlier start is a clock that was not set


class Mdf:
    """A recording of a measurement system; a name that several groups have is `group/name`."""

    def __init__(self, path: Path, stated: Stated):
        asammdf = required('asammdf', 'reading MDF files')
        self.format, self.reader = 'MDF', 'asammdf'
        self.notes: list[str] = []
        self._path = path
        _check_head(path)
        with reading(path, 'MDF file'):
            # by a stream: a path would be mapped whole into memory
            # frames are decoded by the user's database, by one within the file only where there is none
            self._file = asammdf.MDF(
                path.open('rb'),
                raise_on_multiple_occurrences=False,
                process_bus_logging=stated.dbc is None,
            )
            self._file.configure(read_fragment_size=_FRAGMENT)
            self.format = f'MDF {self._file.version}'
            places = list(_places(self._file))
            self._begin = _begin(self._file)
        raw = any(channel.name == FRAME for _, _, channel in places)
        places = [one for one in places if not one[2].name.startswith((FRAME, *OTHER_FRAMES))]
        if not places and not (raw and stated.dbc):
            frames = 'raw CAN frames; name the database that decodes them with --dbc, as .dbc or .kcd'
            raise SignalError(
                f'{path} holds {frames if raw else "no channels; needed are signals over time"}'
            )
        counts = Counter(channel.name for _, _, channel in places)
        full = {
            (group, index): channel.name
            if counts[channel.name] == 1
            else f'{_group_name(self._file, group)}/{channel.name}'
            for group, index, channel in places
        }
        self._places = [(group, index) for group, index, _ in places]
        own = [
            Heading(
                full[group, index], channel.name, channel.unit or _unit_of_conversion(channel), 0, timed=True,
            )
            for group, index, channel in places
        ]  # fmt: skip
        self._frames = self._decoded(stated.dbc) if raw and stated.dbc is not None else None
        self._decoded_headings = [] if self._frames is None else self._frames.settle()
        if raw and self._frames is None:
            self.notes.append('raw CAN frames are left out; --dbc names the database that decodes them')
        self.headings: Sequence[Heading] = unique([*own, *self._decoded_headings])

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen channels with their conversions; invalid samples are NaN."""
        times: dict[int, TimeBase] = {}
        own = [heading for heading in chosen if heading.number < len(self._places)]
        with reading(self._path, 'MDF file'):
            found = {heading.number: self._column(heading, times) for heading in own}
        if self._frames is not None:
            decoded = [heading for heading in chosen if heading not in own]
            places = [self._decoded_headings[heading.number - len(self._places)] for heading in decoded]
            for heading, column in zip(decoded, self._frames.load(places), strict=True):
                found[heading.number] = heading.measured(column.values, column.time)
            self.notes += self._frames.notes
        return [found[heading.number] for heading in chosen]

    def _decoded(self, dbc: Path) -> DecodedFrames:
        self.reader = 'asammdf, cantools'
        return frames_in_mdf(self._file, self._path, dbc, self._begin)

    def _column(self, heading: Heading, times: dict[int, TimeBase]) -> MeasuredColumn:
        group, index = self._places[heading.number]
        self._check_places(group, index)
        signal = self._file.get(group=group, index=index, ignore_invalidation_bits=False)
        if signal.samples.dtype.kind in 'SUO':
            signal = self._file.get(group=group, index=index, raw=True, ignore_invalidation_bits=False)
            self.notes.append(f'{heading.name}: its conversion gives text, so its raw numbers are taken')
        samples = signal.samples
        if samples.dtype.kind not in 'fiub' or samples.ndim != 1:
            raise SignalError(
                f'{self._path}, channel {heading.name!r}: {samples.dtype} of shape {samples.shape} is no '
                'number for each sample; choose another channel'
            )
        values = np.ma.filled(np.ma.asarray(samples, np.float64), np.nan)
        values = np.ascontiguousarray(values)  # a view would hold the records that it is of
        invalid = getattr(signal, 'invalidation_bits', None)
        if invalid is not None:
            bits = np.asarray(invalid, bool)
            values = np.where(bits, np.nan, values)
        if group not in times:
            told = f'times of group {_group_name(self._file, group)}'
            times[group] = TimeBase(np.asarray(signal.timestamps, np.float64), self._begin, told)
        return heading.measured(values, times[group])

    def _check_places(self, number: int, index: int) -> None:
        """Raise `SignalError` for a channel, or its times, beyond the record, where asammdf reads on."""
        group = self._file.groups[number]
        master = self._file.masters_db.get(number)
        size = int(group.channel_group.samples_byte_nr)
        for place in (index, *([] if master is None else [master])):
            channel = group.channels[place]
            if size <= 0 or _end_of(channel) > 8 * size:
                raise SignalError(
                    f'{self._path}, channel {channel.name!r}: ends at bit {_end_of(channel)} of a record of '
                    f'{size} bytes; the file is damaged, export it again'
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


def _places(file: Any) -> Any:
    """Yield group, index and channel of all channels but those of times and parts of structures."""
    for number, group in enumerate(file.groups):
        master = file.masters_db.get(number)
        for index, channel in enumerate(group.channels):
            if index != master and channel.name:
                yield number, index, channel


def _group_name(file: Any, number: int) -> str:
    group = getattr(file.groups[number], 'channel_group', None)
    name = getattr(group, 'acq_name', '') or getattr(group, 'comment', '')
    return name if name and '<' not in name and len(name) < 40 else str(number)


def _unit_of_conversion(channel: Any) -> str:
    conversion = getattr(channel, 'conversion', None)
    unit = getattr(conversion, 'unit', '') or getattr(conversion, 'unit_field', b'')
    if isinstance(unit, bytes):
        unit = unit.decode('latin-1').strip('\x00 ')
    return str(unit)


def _begin(file: Any) -> int:
    """Return when the times of the file begin in ns since 1970, 0 where its clock was not set."""
    seconds = file.start_time.timestamp()
    return round(seconds * _SECOND) if seconds > _DATED else 0
