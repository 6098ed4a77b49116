"""CAN frames, of logs and within MDF 4 files, decoded by a user's database: a column for each signal."""

import math
from array import array
from collections import Counter, defaultdict
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.content import Content, Leaf, Stated, readable
from engine_mount.signals.formats.measured import TimeBase
from engine_mount.signals.signal import SECOND, FloatArray, SignalError

Key = tuple[str, int]
"""Bus, and identifier of a message, with `_EXTENDED` in it where that is an extended one."""
_EXTENDED = 0x80000000
_DATED = 1e8  # s, chosen: no recording is three years long, so that later times count from 1970
_NAMED = 5  # unknown identifiers in a note, chosen
FRAME = 'CAN_DataFrame'
"""The channel of an MDF file that holds frames, a record of what `_MEMBERS` name and others."""
NO_DATABASE = 'name the database that decodes them with --dbc, as .dbc or .kcd'
_MEMBERS = ('ID', 'DataLength', 'DataBytes')


class Frames:
    """Frames of a file by bus and message of the database `dbc`; `notes` grow with what is left out."""

    def __init__(self, path: Path, dbc: Path, notes: list[str]):
        from mount_driver.can_library import cantools

        with readable(dbc, 'database of CAN messages', 'give a .dbc, .arxml, .kcd or .sym file'):
            messages = cantools.database.load_file(str(dbc), strict=False).messages
        self._messages = {one.frame_id | _EXTENDED * one.is_extended_frame: one for one in messages}
        self._groups = {_group(one.frame_id): one for one in messages if _is_j1939(one)}
        self._path, self._dbc, self._notes = path, dbc, notes
        self._times: dict[Key, array[float]] = defaultdict(lambda: array('d'))
        self._payloads: dict[Key, list[bytes]] = defaultdict(list)
        self._unknown: Counter[int] = Counter()

    def add(self, bus: str, identifier: int, extended: bool, time: float, data: bytes) -> None:
        """Add a frame; `time` in s."""
        key = bus, identifier | _EXTENDED * extended
        if key[1] not in self._messages:
            if not extended or _group(identifier) not in self._groups:
                self._unknown[key[1]] += 1
                return
            self._messages[key[1]] = self._groups[_group(identifier)]
        self._times[key].append(time)
        self._payloads[key].append(data)

    def leaves(self, begin: int = 0) -> list[Leaf]:
        """Return the signals there are; a message is decoded, with all its signals, when one is read.

        `begin` (ns since 1970, or 0) is when times begin that do not count from 1970 themselves. Raises
        `SignalError` where no frame is known.
        """
        unknown = ', '.join(f'0x{key & ~_EXTENDED:X} ({n})' for key, n in self._unknown.most_common(_NAMED))
        if not self._times:
            raise SignalError(
                f'{self._path} holds no frame that {self._dbc.name} names ({unknown or "it is empty"}); is '
                'it the database of another bus?'
            )
        if unknown:
            self._notes.append(
                f'{self._unknown.total()} frames of {len(self._unknown)} identifiers that {self._dbc.name} '
                f'does not name: {unknown}'
            )
        leaves, senders = list[Leaf](), defaultdict[Any, set[Key]](set)
        for key in self._times:
            senders[self._messages[key[1]]].add(key)
        for key in sorted(self._times):
            message, decoded = self._messages[key[1]], cache(partial(self._decode, key, begin))
            buses, sources = map(set, zip(*senders[message], strict=True))
            prefix = f'{key[0]}/' * (len(buses) > 1) + f'0x{key[1] & 0xFF:02X}/' * (len(sources) > 1)
            prefix += message.name
            for signal in message.signals:
                name = signal.name
                read, clock = (lambda part=part, name=name, of=decoded: of()[name][part] for part in (0, 1))
                leaves.append(Leaf(f'{prefix}.{name}', read, signal.unit or '', name, clock=clock))
        return leaves

    def _decode(self, key: Key, begin: int) -> dict[str, tuple[FloatArray, TimeBase]]:
        """Return the signals of a message at the times of frames that hold them.

        Frames that do not decode are counted.
        """
        message, payloads = self._messages[key[1]], self._payloads[key]
        columns = {signal.name: np.full(len(payloads), np.nan) for signal in message.signals}
        faulty, reason = 0, ''
        for place, data in enumerate(payloads):
            try:
                values = message.decode(data, decode_choices=False)
            except Exception as error:  # bitstruct and cantools raise several kinds
                faulty, reason = faulty + 1, reason or str(error)
                continue
            for name, value in values.items():
                columns[name][place] = value
        for signal in message.signals if _is_j1939(message) else ():
            column, most = columns[signal.name], _valid_to(signal)
            absent = column > most
            if absent.any():
                column[absent] = np.nan
                self._notes.append(
                    f'{message.name}.{signal.name}: {np.count_nonzero(absent)} of {column.size} samples are '
                    f'sent as not available or as errors (above {most:g}), left out'
                )
        if faulty:
            self._notes.append(
                f'{message.name}: {faulty} of {len(payloads)} frames do not decode ({reason}), left out'
            )
        times, bases = np.array(self._times[key]), dict[bytes, TimeBase]()
        first = min(one[0] for one in self._times.values())
        if first > _DATED:
            times, begin = times - first, round(first * SECOND)
        found = {}
        for name, column in columns.items():
            known = ~np.isnan(column)
            base = TimeBase(times[known], begin, f'times of the frames of {message.name}')
            found[name] = column[known], bases.setdefault(known.tobytes(), base)
        return found


def _is_j1939(message: Any) -> bool:
    """Return whether a message belongs to J1939: by its attributes, or by the null address as source."""
    null = message.is_extended_frame and message.frame_id & 0xFF == 0xFE
    return bool(null or message.protocol == 'j1939')


def _group(identifier: int) -> int:
    """Return the parameter group number of a J1939 identifier (SAE J1939-21): without priority and source.

    A PDU format below 240 is followed by the address of the receiver, which is no part of the number.
    """
    group = identifier >> 8 & 0x3FFFF
    return group if group & 0xFF00 >= 240 << 8 else group & 0x3FF00


def _valid_to(signal: Any) -> float:
    """Return the largest valid value of a J1939 signal; larger ones mean an error or no value.

    SAE J1939-71, section 5.1.4: the raw values of a whole number of bytes are valid up to 0xFA, 0xFAFF, ...
    """
    if signal.is_signed or signal.is_float or signal.length % 8 or signal.conversion.scale < 0.0:
        return math.inf
    return float(signal.conversion.raw_to_scaled((0xFB << signal.length - 8) - 1, decode_choices=False))


def open_can_log(path: Path, stated: Stated) -> Content:
    """Return the signals of a log of CAN frames as `Message.Signal`."""
    from mount_driver.can_library import can

    if stated.dbc is None:
        raise SignalError(f'{path} holds CAN frames; {NO_DATABASE}')
    notes: list[str] = []
    frames, other = Frames(path, stated.dbc, notes), 0
    with readable(path, 'CAN log'), can.LogReader(str(path), relative_timestamp=False) as reader:
        for one in reader:
            if one.is_error_frame or one.is_remote_frame:
                other += 1
                continue
            bus = '' if one.channel is None else str(one.channel)
            frames.add(bus, one.arbitration_id, one.is_extended_id, one.timestamp, bytes(one.data))
    if other:
        notes.append(f'{other} error and remote frames are left out')
    return Content(path, f'CAN log {path.suffix.lower()}', 'python-can, cantools', frames.leaves(), notes)


def is_can_log(path: Path) -> bool:
    """Return whether a text file is a log of CAN frames: ASC and candump share their suffixes with tables."""
    suffix = path.suffix.lower()
    with path.open('rb') as file:
        lines = file.read(4096).decode('latin-1').splitlines()
    if suffix == '.asc':
        return any(line.startswith(('date ', 'base hex', 'base dec')) for line in lines)
    return suffix != '.log' or any(line.startswith('(') and '#' in line for line in lines[:5])


def frames_in_mdf(file: Any, path: Path, dbc: Path, notes: list[str]) -> Frames:
    """Return all frames of an opened MDF file, as ASAM MDF bus logging records them.

    asammdf decodes frames itself, but takes those that are too short for their message as filled with zeros;
    so they are decoded here as those of logs are. Raises `SignalError`.
    """
    frames = Frames(path, dbc, notes)
    for number, group in enumerate(file.groups):
        for index, channel in enumerate(group.channels):
            if channel.name == FRAME:
                _add_records(frames, path, file.get(group=number, index=index))
    return frames


def _add_records(frames: Frames, path: Path, signal: Any) -> None:
    samples = signal.samples
    members = {str(name).rpartition('.')[2]: samples[name] for name in samples.dtype.names or ()}
    if missing := [name for name in _MEMBERS if name not in members]:
        raise SignalError(
            f'{path}: its {FRAME} has no {", ".join(missing)}; needed are {", ".join(_MEMBERS)} of ASAM MDF '
            'bus logging'
        )
    none = np.zeros(len(samples), np.int64)
    identifiers = members['ID'].astype(np.int64)
    extended = members.get('IDE', none).astype(bool) | (identifiers & _EXTENDED > 0)
    rows = zip(
        members.get('BusChannel', none).tolist(), (identifiers & 0x1FFFFFFF).tolist(), extended.tolist(),
        signal.timestamps.tolist(), members['DataBytes'].astype(np.uint8), members['DataLength'].tolist(),
        strict=True,
    )  # fmt: skip
    for bus, identifier, is_extended, time, data, length in rows:
        frames.add(str(bus), identifier, is_extended, time, data[:length].tobytes())
