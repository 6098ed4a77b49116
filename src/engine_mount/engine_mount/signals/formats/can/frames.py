"""Frames of CAN buses by message, decoded by a user's database: a column for each signal."""

from array import array
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase, unique
from engine_mount.signals.signal import SignalError

EXTENDED = 0x80000000
"""Set in the keys of extended identifiers."""
_SECOND = 1_000_000_000  # ns
_DATED = 1e8  # s, chosen: no recording is three years long, so that later times count from 1970
_NAMED = 5  # unknown identifiers in a note, chosen


@dataclass(eq=False)
class _Frames:
    """Times (s) and payloads of all frames of one message on one channel."""

    times: array = field(default_factory=lambda: array('d'))
    lengths: array = field(default_factory=lambda: array('H'))
    payloads: bytearray = field(default_factory=bytearray)


class DecodedFrames:
    """Frames as they are read, then each message of the database that occurs as `Message.Signal`.

    `begin` (ns since 1970, or 0) is when times begin that do not count from 1970 themselves.
    """

    def __init__(self, path: Path, dbc: Path, begin: int = 0):
        self._path, self._dbc, self._zero = path, dbc, begin
        self._database = _database(dbc)
        self._frames: dict[tuple[str, int], _Frames] = {}
        self._unknown: Counter[int] = Counter()
        self.notes: list[str] = []

    def take(self, channel: str, key: int, time: float, data: bytes) -> None:
        """Take a frame: bus, identifier (see `EXTENDED`), time (s) and payload."""
        if key not in self._database:
            self._unknown[key] += 1
            return
        frames = self._frames.setdefault((channel, key), _Frames())
        frames.times.append(time)
        frames.lengths.append(len(data))
        frames.payloads += data

    def take_many(
        self, channel: str, key: int, times: np.ndarray, lengths: np.ndarray, payloads: bytes
    ) -> None:
        """Take frames of one message at once: times (n,) in s, sizes (n,), bytes in a row."""
        if key not in self._database:
            self._unknown[key] += times.size
            return
        frames = self._frames.setdefault((channel, key), _Frames())
        frames.times.frombytes(np.asarray(times, np.float64).tobytes())
        frames.lengths.frombytes(np.asarray(lengths, np.uint16).tobytes())
        frames.payloads += payloads

    def settle(self) -> Sequence[Heading]:
        """Return which signals there are, after the last frame; raises `SignalError` where there are none."""
        self._tell_unknown(self._dbc)
        self._signals = self._found_signals()
        self._dated = all(frames.times[0] > _DATED for frames in self._frames.values())
        self._begin = min((frames.times[0] for frames in self._frames.values()), default=0.0)
        return unique([one.heading for one in self._signals])

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen signals at the times of their frames; frames that do not decode are counted."""
        decoded: dict[tuple[str, int], tuple[dict[str, np.ndarray], np.ndarray]] = {}
        shared: dict[tuple[tuple[str, int], bytes], TimeBase] = {}
        found = []
        for heading in chosen:
            signal = self._signals[heading.number]
            if signal.key not in decoded:
                names = {one.name for one in self._signals if one.key == signal.key}
                wanted = names & {self._signals[one.number].name for one in chosen}
                decoded[signal.key] = self._decoded(signal.key, wanted)
            columns, times = decoded[signal.key]
            values = columns[signal.name]
            present = ~np.isnan(values)
            place = (signal.key, present.tobytes())
            if place not in shared:
                shared[place] = self._time(times[present], signal)
            found.append(heading.measured(values[present], shared[place]))
        return found

    def _tell_unknown(self, dbc: Path) -> None:
        if not self._frames:
            raise SignalError(
                f'{self._path} holds no frame that {dbc.name} names '
                f'({self._told_unknown() or "it is empty"}); is it the database of another bus?'
            )
        if self._unknown:
            self.notes.append(
                f'{sum(self._unknown.values())} frames of {len(self._unknown)} identifiers that {dbc.name} '
                f'does not name: {self._told_unknown()}'
            )

    def _told_unknown(self) -> str:
        return ', '.join(
            f'0x{key & ~EXTENDED:X} ({count})' for key, count in self._unknown.most_common(_NAMED)
        )

    def _found_signals(self) -> list['_Signal']:
        channels = Counter(key for _, key in self._frames)
        found = []
        for channel, key in sorted(self._frames):
            message = self._database[key]
            before = f'{channel}/' if channels[key] > 1 else ''
            for signal in message.signals:
                name = f'{before}{message.name}.{signal.name}'
                heading = Heading(name, signal.name, signal.unit or '', 0, timed=True)
                found.append(_Signal((channel, key), signal.name, heading))
        return found

    def _decoded(self, key: tuple[str, int], names: set[str]) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Return the signals `names` of all frames, NaN where a frame does not hold one, and the times."""
        message, frames = self._database[key[1]], self._frames[key]
        columns = {name: np.full(len(frames.times), np.nan) for name in names}
        begin, faulty, reason = 0, 0, ''
        for place, length in enumerate(frames.lengths):
            data = bytes(frames.payloads[begin : begin + length])
            begin += length
            try:
                values = message.decode(data, decode_choices=False)
            except Exception as error:  # bitstruct and cantools raise several kinds
                faulty, reason = faulty + 1, reason or str(error)
                continue
            for name in names & values.keys():
                columns[name][place] = values[name]
        if faulty:
            self.notes.append(
                f'{message.name}: {faulty} of {len(frames.times)} frames do not decode ({reason}), left out'
            )
        return columns, np.frombuffer(frames.times, np.float64)

    def _time(self, times: np.ndarray, signal: '_Signal') -> TimeBase:
        told = f'times of the frames of {signal.heading.name.rpartition(".")[0]}'
        if not self._dated:
            return TimeBase(times.copy(), self._zero, told)
        return TimeBase(times - self._begin, round(self._begin * _SECOND), told)


@dataclass(frozen=True)
class _Signal:
    key: tuple[str, int]
    name: str
    heading: Heading


def _database(dbc: Path) -> dict[int, Any]:
    """Return the messages of a database by identifier, bit 31 set in extended ones."""
    from mount_driver.can_library import cantools

    with reading(dbc, 'database of CAN messages', 'give a .dbc, .arxml, .kcd or .sym file'):
        database = cantools.database.load_file(str(dbc), strict=False)
        messages = database.messages
    return {one.frame_id | (EXTENDED if one.is_extended_frame else 0): one for one in messages}
