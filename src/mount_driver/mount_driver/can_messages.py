"""What the messages of `mount.dbc` carry, in SI units.

Apart from their protection, whose library a desk that opens no bus need not have.
"""

import struct
import zlib
from collections.abc import Sequence
from typing import NamedTuple


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
    """False: the coil driver shall be off, whatever `current` is."""


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


class OwnSetpoint(NamedTuple):
    """The setpoint of electronics that compute the law themselves (MountOwnSetpoint, electronics to host)."""

    answered_counter: int
    """`sample_counter` of the sample that it answers."""
    next_point: int
    """Which point of the table the electronics wait for; the number of points when they hold them all."""
    table_crc: int
    """`table_crc` of the table that the electronics hold or load, 0 without one."""
    current: float
    """A, to the bit; NaN while the law does not run."""


class TablePoint(NamedTuple):
    """One point of the table for the law in the electronics (MountLawTable, host to electronics)."""

    point: int
    points: int
    """Number of all points; 0: there is no table."""
    table_crc: int
    current: float
    """A; that of point 0 is the offset current."""
    normal_force: float
    """N; 0 in point 0."""


def table_crc(points: Sequence[tuple[float, float]]) -> int:
    """Return the CRC-32 over all points (A, N) as they are sent, 0 without any."""
    return zlib.crc32(b''.join(struct.pack('<2d', *point) for point in points))
