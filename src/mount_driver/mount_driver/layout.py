"""Where each signal of a message lies, from the DBC, as compiled bit fields with their check sum.

cantools takes about 15 us to encode and 11 us to decode the measurement, which is too much at several
kHz. So the positions, lengths, signs, scales and limits are read from its database once; after that one
call of a compiled bit field does the work. A test holds the result against cantools.
"""

import math
from collections.abc import Sequence
from decimal import Decimal
from operator import itemgetter
from typing import Any

import bitstruct.c
from e2e.p05 import e2e_p05_check, e2e_p05_protect

from mount_driver.can_library import Message, Signal

# Steps from the DBC's units to SI; other units are kept and appear in the name of the field.
_SI_FACTORS = {'mm': Decimal('0.001')}


class DatabaseError(ValueError):
    """The DBC does not describe what this driver needs; the text says what is missing."""


class OutOfRangeError(ValueError):
    """A value lies outside the limits that the DBC gives for its signal."""


class FrameError(ValueError):
    """A frame has not the length of its message, or its CRC does not fit: it is damaged, or another one."""


class Scaling:
    """One signal between its SI value and its raw whole number, with the limits of the DBC."""

    def __init__(self, signal: Signal):
        scale = Decimal(str(signal.scale)) * _SI_FACTORS.get(signal.unit or '', Decimal(1))
        self.steps = float(1 / scale)  # raw steps per SI unit
        if signal.offset or not self.steps.is_integer():
            raise DatabaseError(
                f'{signal.name}: factor {signal.scale} and offset {signal.offset} are not usable; '
                f'needed are offset 0 and a whole number of steps per unit'
            )
        self.name = signal.name
        self.unit = 'm' if signal.unit == 'mm' else (signal.unit or '1')
        self.raw_low, self.raw_high = (_raw_limit(signal, limit) for limit in ('minimum', 'maximum'))
        self.low, self.high = self.to_si(self.raw_low), self.to_si(self.raw_high)

    def to_raw(self, value: float) -> int:
        """Return the nearest raw number; raises `OutOfRangeError`, also for infinity; NaN is not allowed."""
        scaled = value * self.steps
        if self.raw_low <= scaled <= self.raw_high:
            return round(scaled)
        raise OutOfRangeError(
            f'{self.name} ({value:g} {self.unit}) must lie within {self.low:g} .. {self.high:g} {self.unit}; '
            f'send a reading outside as not valid (NaN)'
        )

    def within(self, value: float) -> float:
        """Return `value`, or NaN where it lies outside the limits."""
        return value if self.raw_low <= value * self.steps <= self.raw_high else math.nan

    def to_si(self, raw: int) -> float:
        """Return the SI value of a raw number, the nearest float64; NaN where it lies outside the limits."""
        return raw / self.steps if self.raw_low <= raw <= self.raw_high else math.nan


class MessageLayout:
    """Packs and unpacks the raw numbers of one message, in the order of `names`."""

    def __init__(self, message: Message, names: Sequence[str]):
        signals = sorted(message.signals, key=lambda signal: signal.start)
        known = [signal.name for signal in signals]
        if sorted(known) != sorted(names):
            raise DatabaseError(f'{message.name} has the signals {known}; this driver needs {list(names)}')
        self.name = message.name
        self.names = tuple(names)
        self.frame_id = message.frame_id
        self.length = message.length
        self.data_id = _attribute(message, 'E2EDataId')
        self.max_delta_counter = _attribute(message, 'E2EMaxDeltaCounter')
        self.sync_frames = _attribute(message, 'E2ESyncFrames')
        bits = bitstruct.c.compile(_reversed_bit_format(message, signals))
        self.pack_bits, self.unpack_bits = bits.pack, bits.unpack
        """Between the raw numbers in the order of the wire and the reversed bytes of a message."""
        # The bit format runs from the last bit to the first.
        known.reverse()
        self.to_wire = itemgetter(*(list(names).index(name) for name in known))
        self.from_wire = itemgetter(*(known.index(name) for name in names))
        """Returns the raw numbers in the order of `names`, from those that `unpack_bits` returns."""

    def pack(self, raw: Sequence[int]) -> bytearray:
        """Return the message with these raw numbers and its CRC; raises `OutOfRangeError`."""
        try:
            data = bytearray(self.pack_bits(*self.to_wire(raw)))
        except OverflowError:
            numbers = ', '.join(f'{name} {number}' for name, number in zip(self.names, raw, strict=True))
            raise OutOfRangeError(f'{self.name}: a number does not fit its bits: {numbers}') from None
        data.reverse()
        e2e_p05_protect(data, self.data_id, increment_counter=False)
        return data

    def unpack(self, data: bytes | bytearray) -> tuple[int, ...]:
        """Return the raw numbers of a message; raises `FrameError`."""
        if len(data) != self.length:
            raise FrameError(f'frame 0x{self.frame_id:X} has {len(data)} bytes; the DBC has {self.length}')
        if not e2e_p05_check(data, self.data_id):
            raise FrameError(f'frame 0x{self.frame_id:X} fails its CRC; the frame is not used')
        return self.from_wire(self.unpack_bits(data[::-1]))


def _raw_limit(signal: Signal, limit: str) -> int:
    value = getattr(signal, limit)
    if value is None:
        raise DatabaseError(f'{signal.name} has no {limit} in the DBC; every signal needs its limits')
    return round(Decimal(str(value)) / Decimal(str(signal.scale)))


def _attribute(message: Message, name: str) -> Any:
    attributes = message.dbc.attributes if message.dbc else {}
    if name not in attributes:
        raise DatabaseError(f'{message.name} has no attribute {name} in the DBC')
    return attributes[name].value


def _reversed_bit_format(message: Message, signals: list[Signal]) -> str:
    # Little-endian signals are contiguous bit fields once the order of the bytes is reversed.
    fields: list[str] = []
    position = 0
    for signal in signals:
        if signal.byte_order != 'little_endian' or signal.start < position or signal.is_float:
            raise DatabaseError(
                f'{signal.name} must be a little-endian whole number apart from other signals'
            )
        fields.append(f'p{signal.start - position}' if signal.start > position else '')
        fields.append(f'{"s" if signal.is_signed else "u"}{signal.length}')
        position = signal.start + signal.length
    rest = message.length * 8 - position
    fields.append(f'p{rest}' if rest else '')
    return ''.join(reversed(fields))
