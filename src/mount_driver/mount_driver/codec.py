"""The three messages of `mount.dbc` in SI units, protected end to end: one codec for both ends of the bus.

All numbers of the wire (positions, scales, limits, data ids) come from the DBC. Protection is AUTOSAR E2E
profile 5: a 16 bit CRC over all other bytes and the data id, and an 8 bit alive counter.
"""

import math
from pathlib import Path
from typing import NamedTuple

from e2e.p05 import e2e_p05_check, e2e_p05_protect

from mount_driver.can_library import Database
from mount_driver.layout import DatabaseError, MessageLayout, OutOfRangeError, Scaling

__all__ = [
    'DATABASE_FILE',
    'DatabaseError',
    'Measurement',
    'MountCodec',
    'OutOfRangeError',
    'Setpoint',
    'Status',
    'WrongCrcError',
    'WrongLengthError',
]

DATABASE_FILE = Path(__file__).parent / 'dbc' / 'mount.dbc'

_HEADER = ('Crc', 'AliveCounter')
_MEASUREMENT = (
    *_HEADER,
    'DisplacementValid',
    'CurrentValid',
    'RippleValid',
    'Enabled',
    'SetpointTimeout',
    'CurrentLimited',
    'SampleCounter',
    'Microseconds',
    'Displacement',
    'CoilCurrent',
    'CurrentRate',
    'FluxRate',
)
_SETPOINT = (*_HEADER, 'Current', 'AnsweredCounter', 'Enable')
_STATUS = (
    *_HEADER,
    'SupplyVoltage',
    'CoilTemperature',
    'OverTemperature',
    'OverCurrent',
    'UnderVoltage',
    'SetpointTimeout',
    'DisplacementSensor',
    'E2EError',
)
_VOLTAGE_NOT_AVAILABLE = 65535  # value tables of the DBC
_TEMPERATURE_NOT_AVAILABLE = -32768


class WrongLengthError(ValueError):
    """A frame has not the length of its message."""


class WrongCrcError(ValueError):
    """A frame's CRC does not fit its bytes and its data id: it was damaged or is not what its id says."""


class Measurement(NamedTuple):
    """One sample of the mount (MountMeasurement, electronics to host)."""

    sample_counter: int
    """Number of the sample, 0..65535, wraps; a sample sent again keeps its number."""
    microseconds: int
    """Time of the sample on the clock of the electronics, us, 0..2**32-1, wraps."""
    displacement: float
    """Engine minus chassis, m; NaN where the sensor has no valid reading."""
    coil_current: float
    """Mean coil current, A; NaN where not valid."""
    current_rate: float
    """Slope of the coil current 18 us after switching, A/s; NaN where not valid."""
    flux_rate: float
    """Slope of the flux density 18 us after switching, T/s; NaN where not valid."""
    enabled: bool = True
    """The coil driver is switched on."""
    setpoint_timeout: bool = False
    """The electronics had no valid setpoint for 20 ms and went to 0 A on their own."""
    current_limited: bool = False
    """The setpoint lies above what the electronics give at present."""


class Setpoint(NamedTuple):
    """The wanted coil current (MountSetpoint, host to electronics)."""

    current: float
    """A, 0..3."""
    answered_counter: int
    """`sample_counter` of the sample that this setpoint answers."""
    enable: bool = True
    """False: the coil driver shall be off, whatever `current` says."""


class Status(NamedTuple):
    """Health of the electronics (MountStatus, electronics to host)."""

    supply_voltage: float
    """V; NaN where not available."""
    coil_temperature_celsius: float
    """degC; NaN where not available."""
    over_temperature: bool = False
    over_current: bool = False
    under_voltage: bool = False
    setpoint_timeout: bool = False
    displacement_sensor: bool = False
    e2e_error: bool = False

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of the fault bits that are set."""
        return tuple(name for name in self._fields[2:] if getattr(self, name))


class MountCodec:
    """Encodes and decodes the messages of `mount.dbc`; no state but its tables, so one serves all threads.

    Encoding takes the alive counter (0..255) of the frame, decoding returns it with the message. Decoding
    raises `WrongLengthError` or `WrongCrcError` before it looks at any number.
    """

    def __init__(self, database_file: Path = DATABASE_FILE):
        database = Database()
        database.add_dbc_file(database_file)
        measurement = database.get_message_by_name('MountMeasurement')
        setpoint = database.get_message_by_name('MountSetpoint')
        status = database.get_message_by_name('MountStatus')
        self.measurement = MessageLayout(measurement, _MEASUREMENT)
        self.setpoint = MessageLayout(setpoint, _SETPOINT)
        self.status = MessageLayout(status, _STATUS)
        self.displacement = Scaling(measurement.get_signal_by_name('Displacement'))
        self.coil_current = Scaling(measurement.get_signal_by_name('CoilCurrent'))
        self.current_rate = Scaling(measurement.get_signal_by_name('CurrentRate'))
        self.flux_rate = Scaling(measurement.get_signal_by_name('FluxRate'))
        self.current = Scaling(setpoint.get_signal_by_name('Current'))
        self.supply_voltage = Scaling(status.get_signal_by_name('SupplyVoltage'))
        self.coil_temperature = Scaling(status.get_signal_by_name('CoilTemperature'))

    def encode_measurement(self, measurement: Measurement, alive_counter: int) -> bytearray:
        """Return the 24 bytes of a sample; NaN is sent as not valid. Raises `OutOfRangeError`.

        The two slopes share one validity: if one of them is NaN, both arrive as NaN.
        """
        counter, microseconds, displacement, current, current_rate, flux_rate, *bits = measurement
        displacement_valid = displacement == displacement  # false for NaN alone, and faster than isnan
        current_valid = current == current
        ripple_valid = current_rate == current_rate and flux_rate == flux_rate
        return _protected(
            self.measurement,
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
            ),
        )

    def decode_measurement(self, data: bytes | bytearray) -> tuple[int, Measurement]:
        """Return alive counter and sample; what is not valid or lies outside the DBC's limits is NaN."""
        (
            _,
            alive_counter,
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
        ) = _checked(self.measurement, data)
        return alive_counter, Measurement(
            counter,
            microseconds,
            _reading(self.displacement, displacement, displacement_valid),
            _reading(self.coil_current, current, current_valid),
            _reading(self.current_rate, current_rate, ripple_valid),
            _reading(self.flux_rate, flux_rate, ripple_valid),
            enabled == 1,
            setpoint_timeout == 1,
            current_limited == 1,
        )

    def encode_setpoint(self, setpoint: Setpoint, alive_counter: int) -> bytearray:
        """Return the 8 bytes of a setpoint, limited to 0..3 A; NaN is refused with `OutOfRangeError`."""
        current, answered_counter, enable = setpoint
        limits = self.current
        if current != current:
            raise OutOfRangeError(
                f'current setpoint (NaN) must lie within {limits.low:g} .. {limits.high:g} A; '
                f'send 0 A with enable off where no setpoint is known'
            )
        raw = limits.to_raw(min(max(current, limits.low), limits.high))
        return _protected(self.setpoint, (0, alive_counter, raw, answered_counter, enable))

    def decode_setpoint(self, data: bytes | bytearray) -> tuple[int, Setpoint | None]:
        """Return alive counter and setpoint, which is None where its current exceeds the DBC's limit."""
        _, alive_counter, current, answered_counter, enable = _checked(self.setpoint, data)
        if not self.current.holds(current):
            return alive_counter, None
        return alive_counter, Setpoint(self.current.to_si(current), answered_counter, enable == 1)

    def encode_status(self, status: Status, alive_counter: int) -> bytearray:
        """Return the 8 bytes of a status; NaN is sent as not available. Raises `OutOfRangeError`."""
        voltage, temperature, *faults = status
        raw_voltage = _VOLTAGE_NOT_AVAILABLE if math.isnan(voltage) else self.supply_voltage.to_raw(voltage)
        raw_temperature = (
            _TEMPERATURE_NOT_AVAILABLE
            if math.isnan(temperature)
            else self.coil_temperature.to_raw(temperature)
        )
        return _protected(self.status, (0, alive_counter, raw_voltage, raw_temperature, *faults))

    def decode_status(self, data: bytes | bytearray) -> tuple[int, Status]:
        """Return alive counter and status; what is not available or lies outside the DBC's limits is NaN."""
        _, alive_counter, voltage, temperature, *faults = _checked(self.status, data)
        return alive_counter, Status(
            _reading(self.supply_voltage, voltage, True),
            _reading(self.coil_temperature, temperature, True),
            *(fault == 1 for fault in faults),
        )


def _protected(layout: MessageLayout, raw: tuple[int, ...]) -> bytearray:
    data = layout.pack(raw)
    e2e_p05_protect(data, layout.data_id, increment_counter=False)
    return data


def _checked(layout: MessageLayout, data: bytes | bytearray) -> tuple[int, ...]:
    if len(data) != layout.length:
        raise WrongLengthError(
            f'frame 0x{layout.frame_id:X} has {len(data)} bytes; the DBC says {layout.length}'
        )
    if not e2e_p05_check(data, layout.data_id):
        raise WrongCrcError(f'frame 0x{layout.frame_id:X} fails its CRC; the frame is not used')
    return layout.unpack(data)


def _reading(scaling: Scaling, raw: int, valid: int) -> float:
    return raw / scaling.steps if valid and scaling.raw_low <= raw <= scaling.raw_high else math.nan
