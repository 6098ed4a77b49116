"""The messages of `mount.dbc` in SI units, protected end to end; both ends of the bus run this code.

All numbers of the wire (positions, scales, limits, data ids) come from the DBC. Protection is AUTOSAR E2E
profile 5: a 16 bit CRC over all other bytes and the data id, and an 8 bit alive counter.
"""

from enum import IntEnum
from functools import cache
from math import isnan, nan
from pathlib import Path
from typing import Generic, TypeVar

from e2e.p05 import e2e_p05_check, e2e_p05_protect

from mount_driver.can_library import Database
from mount_driver.can_messages import Measurement, OwnSetpoint, Setpoint, Status, TablePoint
from mount_driver.layout import MessageLayout, Scaling

M = TypeVar('M')

DATABASE_FILE = Path(__file__).parent / 'dbc' / 'mount.dbc'

_VOLTAGE_NOT_AVAILABLE = 65535  # value tables of the DBC
_TEMPERATURE_NOT_AVAILABLE = -32768
_LOOK_BACK = 16  # frames, chosen: a sequence that goes on so soon after it was left still has its sender
_new = tuple.__new__  # makes a named tuple without the call of a Python function


class MountCodec:
    """Encodes and decodes the messages of `mount.dbc`; no state but its tables, so one serves all threads.

    Encoding takes the alive counter (0..255) of the frame. What is received is decoded by an `E2EReceiver`.
    """

    def __init__(self, database_file: Path = DATABASE_FILE):
        database = Database()
        database.add_dbc_file(database_file)
        measurement, setpoint, status, own_setpoint, table_point = messages = database.messages
        self.measurement = MessageLayout(measurement, self._measurement_of)
        self.setpoint = MessageLayout(setpoint, self._setpoint_of)
        self.status = MessageLayout(status, self._status_of)
        self.own_setpoint = MessageLayout(own_setpoint, lambda raw: OwnSetpoint(*raw[2:]))
        self.table_point = MessageLayout(table_point, lambda raw: TablePoint(*raw[2:]))
        scalings = {signal.name: Scaling(signal) for message in messages for signal in message.signals}
        self.displacement, self.coil_current = scalings['Displacement'], scalings['CoilCurrent']
        self.current_rate, self.flux_rate = scalings['CurrentRate'], scalings['FluxRate']
        self.current = scalings['Current']
        self.supply_voltage, self.coil_temperature = scalings['SupplyVoltage'], scalings['CoilTemperature']

    def encode_measurement(self, measurement: Measurement, alive_counter: int) -> bytearray:
        """Return the 24 bytes of a sample; NaN is sent as not valid. Raises `ParameterError`.

        The two slopes share one validity: if one of them is NaN, both arrive as NaN.
        """
        counter, microseconds, displacement, current, current_rate, flux_rate, *bits = measurement
        displacement_valid = displacement == displacement  # false for NaN alone, and faster than isnan
        current_valid = current == current
        ripple_valid = current_rate == current_rate and flux_rate == flux_rate
        return self.measurement.pack(
            (
                0,
                alive_counter,
                displacement_valid,
                current_valid,
                ripple_valid,
                *bits,
                counter,
                microseconds,
                self.displacement.to_raw(displacement) if displacement_valid else 0,
                self.coil_current.to_raw(current) if current_valid else 0,
                self.current_rate.to_raw(current_rate) if ripple_valid else 0,
                self.flux_rate.to_raw(flux_rate) if ripple_valid else 0,
            )
        )

    def _measurement_of(self, raw: tuple[int, ...]) -> Measurement:
        """Return the sample of raw numbers; what is not valid or lies outside the DBC's limits is NaN."""
        # Without a function for each number: this runs for every sample.
        (
            _,
            _,
            displacement_valid,
            current_valid,
            ripple_valid,
            enabled,
            setpoint_timeout,
            current_limited,
            counter,
            microseconds,
            displacement,
            current,
            current_rate,
            flux_rate,
        ) = raw
        x, i, di, db = self.displacement, self.coil_current, self.current_rate, self.flux_rate
        return _new(
            Measurement,
            (
                counter,
                microseconds,
                displacement / x.steps
                if displacement_valid and x.raw_low <= displacement <= x.raw_high
                else nan,
                current / i.steps if current_valid and i.raw_low <= current <= i.raw_high else nan,
                current_rate / di.steps
                if ripple_valid and di.raw_low <= current_rate <= di.raw_high
                else nan,
                flux_rate / db.steps if ripple_valid and db.raw_low <= flux_rate <= db.raw_high else nan,
                enabled == 1,
                setpoint_timeout == 1,
                current_limited == 1,
            ),
        )

    def encode_setpoint(self, setpoint: Setpoint, alive_counter: int) -> bytearray:
        """Return the 8 bytes of a setpoint, limited to 0..3 A; raises `ValueError` for NaN."""
        current, answered_counter, enable = setpoint
        limits = self.current
        raw = round(min(max(current, limits.low), limits.high) * limits.steps)
        # As `MessageLayout.pack` does, without its call.
        data = bytearray(self.setpoint.pack_bits(enable, answered_counter, raw, alive_counter, 0))
        data.reverse()
        e2e_p05_protect(data, self.setpoint.data_id, increment_counter=False)
        return data

    def _setpoint_of(self, raw: tuple[int, ...]) -> Setpoint | None:
        """Return the setpoint of raw numbers, None where its current exceeds the DBC's limit."""
        _, _, current, answered_counter, enable = raw
        limits = self.current
        if not limits.raw_low <= current <= limits.raw_high:
            return None
        return Setpoint(current / limits.steps, answered_counter, enable == 1)

    def encode_status(self, status: Status, alive_counter: int) -> bytearray:
        """Return the 8 bytes of a status; NaN is sent as not available. Raises `ParameterError`."""
        voltage, temperature, *faults = status
        raw_voltage = _VOLTAGE_NOT_AVAILABLE if isnan(voltage) else self.supply_voltage.to_raw(voltage)
        raw_temperature = (
            _TEMPERATURE_NOT_AVAILABLE if isnan(temperature) else self.coil_temperature.to_raw(temperature)
        )
        return self.status.pack((0, alive_counter, raw_voltage, raw_temperature, *faults))

    def _status_of(self, raw: tuple[int, ...]) -> Status:
        """Return the status of raw numbers; what is not available or outside the DBC's limits is NaN."""
        _, _, voltage, temperature, *faults = raw
        return Status(
            self.supply_voltage.to_si(voltage),
            self.coil_temperature.to_si(temperature),
            *(fault == 1 for fault in faults),
        )


@cache
def mount_codec() -> MountCodec:
    """Return the codec of the project's DBC, which is read on the first call."""
    return MountCodec()


class Outcome(IntEnum):
    """What became of a frame: the first two are used, those from `REPEATED` on have failed a check."""

    OK = 0  # the next one
    LOST = 1  # in order, but frames before it are missing: see `E2EReceiver.lost`
    SYNCHRONISING = 2  # in order, but too soon after a wrong sequence or the start to be believed
    REPEATED = 3  # the same alive counter as the last one
    WRONG_SEQUENCE = 4  # its counter went back, or farther ahead than frames may be missing
    CORRUPT = 5  # its length or CRC is wrong, or its content is not allowed


_OK, _LOST = Outcome.OK, Outcome.LOST  # a look-up in the class costs more


class AliveCounter:
    """The sender's 8 bit counter: one for each message."""

    def __init__(self) -> None:
        self._next = 0

    def next(self) -> int:
        """Return the counter of the frame to be sent, 0..255."""
        counter = self._next
        self._next = (counter + 1) & 0xFF
        return counter


class E2EReceiver(Generic[M]):
    """Checks and decodes the frames of one message, judges their order by the alive counter and counts."""

    def __init__(self, layout: MessageLayout[M]):
        self.outcome = _OK
        """Of the last frame."""
        self.counts = [0] * len(Outcome)
        """Frames by `Outcome`."""
        self.lost = 0
        """Frames missing so far."""
        self.strangers = 0
        """Sound frames that one sender alone cannot have sent.

        They carry another content under the counter of the last one, or go on with a sequence that was left
        for another a few frames before. Losses and a restart of the sender do neither.
        """
        self._layout, self._message_of = layout, layout.message_of
        self._last = -1  # alive counter of the last frame whose CRC was good; none yet
        self._awaited = 0  # frames in order that must still come before one is used
        self._last_data: bytes | bytearray = b''
        self._left: list[tuple[int, int]] = []  # last counters of sequences that were left, and when

    def receive(self, data: bytes | bytearray) -> M | None:
        """Return the message of a frame, or None where it must not be used; see `outcome`."""
        layout, message = self._layout, None
        if len(data) != layout.length or not e2e_p05_check(data, layout.data_id):
            outcome = Outcome.CORRUPT
        else:
            raw = layout.unpack_bits(data[::-1])[::-1]
            if (raw[1] - self._last) & 0xFF == 1 and not self._awaited:
                outcome = _OK
            else:
                outcome = self._judge_order(raw[1], data)
            self._last, self._last_data = raw[1], data
            message = self._message_of(raw)
            if message is None:
                outcome = Outcome.CORRUPT
        self.outcome = outcome
        self.counts[outcome] += 1
        return message if outcome <= _LOST else None

    @property
    def failed(self) -> int:
        """Frames that failed a check: the corrupt, the repeated and those of wrong sequence."""
        return sum(self.counts[Outcome.REPEATED :])

    def _judge_order(self, alive: int, data: bytes | bytearray) -> Outcome:
        last = self._last
        step = (alive - last) & 0xFF if last >= 0 else alive + 1  # a receiver that starts counts on from 255
        if step == 0:
            self.strangers += data != self._last_data
            return Outcome.REPEATED
        if step > self._layout.max_delta_counter:
            self._awaited = self._layout.sync_frames
            if last < 0:
                return Outcome.SYNCHRONISING
            self._leave(last, alive)
            return Outcome.WRONG_SEQUENCE
        self.lost += step - 1
        if self._awaited > 0:
            self._awaited -= 1
            if self._awaited > 0:
                return Outcome.SYNCHRONISING
        return _OK if step == 1 else _LOST

    def _leave(self, last: int, alive: int) -> None:
        """Note that `alive` does not follow `last`; it may go on with a sequence that was left before."""
        frames = sum(self.counts)
        self._left = [(counter, at) for counter, at in self._left if frames - at < _LOOK_BACK]
        if any(1 <= (alive - counter) & 0xFF <= self._layout.max_delta_counter for counter, _ in self._left):
            self.strangers += 1
        self._left.append((last, frames))
