"""Watches of whole messages: who sends them, and what follows from the content of `MountStatus`.

No bus and no clock here: times are ns by the clock that judges ages (`Clock.now`).
"""

from collections import deque
from typing import Annotated, NamedTuple

from mount_driver.protocol import Status
from mount_models.quantity import Quantity

_REMEDIES = {
    'over_current': 'check coil, cable and power stage for a short circuit',
    'over_temperature': 'let the coil cool down',
    'under_voltage': 'check battery, generator and wiring',
}
"""Bits of the status that switch the coil off."""


class SenderLimits(NamedTuple):
    """From when on frames that one sender alone cannot have sent mean that there is a second one."""

    limit: Annotated[
        int, Quantity('1', 'so many frames of a second sender take the coil to 0 A', 1, 100, 'chosen')
    ] = 3
    window: Annotated[float, Quantity('s', 'when they come within this time', 0.1, 3600.0, 'chosen')] = 10.0


class SenderWatch:
    """Whether a message has one sender only, by what its receiver has counted (`E2EReceiver.strangers`).

    Both ends of the bus run this code.
    """

    def __init__(self, limits: SenderLimits, message: str, remedy: str):
        self._limits = limits
        self._message, self._remedy = message, remedy
        self._window = round(1e9 * limits.window)
        self._counted = 0
        self._times: deque[int] = deque(maxlen=limits.limit)
        self.last: int | None = None
        """Time of the last frame of a second sender; None before the first."""

    def judge(self, strangers: int, now: int) -> str:
        """Take the number of such frames so far; return why the coil is to be off, empty if it is not."""
        if strangers == self._counted:
            return ''
        self._times.extend([now] * min(strangers - self._counted, self._limits.limit))
        self._counted, self.last = strangers, now
        if len(self._times) < self._limits.limit or now - self._times[0] > self._window:
            return ''
        return (
            f'{len(self._times)} frames {self._message} within {self._limits.window:g} s (limit '
            f'{self._limits.limit}) had a counter or content that does not go on with the others: '
            f'a second sender is on the bus, or old frames are sent again; {self._remedy}'
        )


class StatusLimits(NamedTuple):
    """Within which values of `MountStatus` the coil may carry current."""

    lowest_supply: Annotated[
        float, Quantity('V', 'below it the coil is switched off', 0.0, 60.0, 'chosen, ISO 16750-2 code C')
    ] = 9.0
    highest_supply: Annotated[
        float, Quantity('V', 'above it the coil is switched off', 0.0, 60.0, 'chosen, ISO 16750-2 code C')
    ] = 16.0
    highest_temperature_celsius: Annotated[
        float,
        Quantity('degC', 'above it the coil is switched off', -60.0, 250.0, 'chosen, insulation class H'),
    ] = 180.0
    timeout: Annotated[
        float, Quantity('s', 'without a status for so long the coil stays at 0 A', 0.2, 10.0, 'chosen')
    ] = 1.0


class StatusWatch:
    """Keeps the newest status and the time until which it counts."""

    def __init__(self, limits: StatusLimits):
        self._limits = limits
        self._timeout = round(1e9 * limits.timeout)
        self.valid_until: int | None = None
        """Time from which on a status is missing; None before the first call."""
        self.sensor_fault = False
        """Whether the newest status reports a fault of the displacement sensor."""

    def judge(self, status: Status, now: int) -> str:
        """Take a status; return why the coil is to be off until the next initialisation, else empty."""
        self.valid_until, self.sensor_fault = now + self._timeout, status.displacement_sensor
        voltage, celsius = status.supply_voltage, status.coil_temperature_celsius
        limits = self._limits
        for name, remedy in _REMEDIES.items():
            if getattr(status, name):
                values = f'is 1, must be 0; {celsius:.1f} degC, {voltage:.2f} V'
                return f'the electronics report {name} ({values}): {remedy}'
        if voltage < limits.lowest_supply or voltage > limits.highest_supply:
            within = f'{limits.lowest_supply:g} .. {limits.highest_supply:g} V'
            return f'supply voltage ({voltage:.2f} V) must lie within {within}: check battery and generator'
        if celsius > limits.highest_temperature_celsius:
            limit = f'{limits.highest_temperature_celsius:g} degC'
            return f'coil temperature ({celsius:.1f} degC) must not exceed {limit}: let the coil cool down'
        return ''

    def hold(self, now: int) -> str:
        """Return why the current is 0 A for as long as this stands, else empty."""
        if self.valid_until is None:
            self.valid_until = now + self._timeout
        if now > self.valid_until:
            missing = f'no status of the electronics for more than {self._limits.timeout:g} s'
            return f'{missing}: supply and coil temperature are not known; check bus and electronics'
        if self.sensor_fault:
            fault = 'a fault of the displacement sensor (displacement_sensor is 1, must be 0)'
            return f'the electronics report {fault}: check the sensor and its cable'
        return ''
