"""Watches of whole messages: who sends them, and what follows from the content of `MountStatus`.

No bus and no clock here: times are ns by the clock that judges ages (`Clock.now`).
"""

from collections import deque
from typing import Annotated, NamedTuple

from mount_driver.can_messages import Status
from mount_models.quantity import Quantity

_REMEDIES = {
    'over_current': 'check coil, cable and power stage for a short circuit',
    'over_temperature': 'let the coil cool down',
    'under_voltage': 'check battery, generator and wiring',
}
"""Bits of the status that switch the coil off."""

_TIMEOUT = 1_000_000_000  # ns, chosen: without a status for so long the coil stays at 0 A
_FRAMES = 3  # chosen: so many frames of a second sender within `_WINDOW` take the coil to 0 A
_WINDOW = 10_000_000_000  # ns, chosen


class SenderWatch:
    """Whether a message has one sender only, by what its receiver has counted (`E2EReceiver.strangers`).

    Both ends of the bus run this code.
    """

    def __init__(self, message: str, remedy: str):
        self._message, self._remedy = message, remedy
        self._counted = 0
        self._times: deque[int] = deque(maxlen=_FRAMES)

    def judge(self, strangers: int, now: int) -> str:
        """Take the number of such frames so far; return why the coil is to be off, empty if it is not."""
        if strangers == self._counted:
            return ''
        self._times.extend([now] * min(strangers - self._counted, _FRAMES))
        self._counted = strangers
        if len(self._times) < _FRAMES or now - self._times[0] > _WINDOW:
            return ''
        return (
            f'{_FRAMES} frames {self._message} within 10 s (limit {_FRAMES}) had a counter or content '
            f'that does not go on with the others: a second sender is on the bus, or old frames are sent '
            f'again; {self._remedy}'
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


class StatusWatch:
    """Keeps the newest status and the time until which it counts."""

    def __init__(self, limits: StatusLimits):
        self._limits = limits
        self.valid_until: int | None = None
        """Time from which on a status is missing; None before the first call."""
        self.sensor_fault = False
        """Whether the newest status reports a fault of the displacement sensor."""

    def judge(self, status: Status, now: int) -> str:
        """Take a status; return why the coil is to be off until the next initialisation, else empty."""
        self.valid_until, self.sensor_fault = now + _TIMEOUT, status.displacement_sensor
        voltage, celsius = status.supply_voltage, status.coil_temperature_celsius
        limits = self._limits
        for name, remedy in _REMEDIES.items():
            if getattr(status, name):
                return (
                    f'the electronics report {name} (is 1, must be 0; {celsius:.1f} degC, {voltage:.2f} V): '
                    f'{remedy}'
                )
        if voltage < limits.lowest_supply or voltage > limits.highest_supply:
            return (
                f'supply voltage ({voltage:.2f} V) must lie within {limits.lowest_supply:g} .. '
                f'{limits.highest_supply:g} V: check battery and generator'
            )
        if celsius > limits.highest_temperature_celsius:
            return (
                f'coil temperature ({celsius:.1f} degC) must not exceed '
                f'{limits.highest_temperature_celsius:g} degC: let the coil cool down'
            )
        return ''

    def hold(self, now: int) -> str:
        """Return why the current is 0 A for as long as this stands, else empty."""
        if self.valid_until is None:
            self.valid_until = now + _TIMEOUT
        if now > self.valid_until:
            return (
                'no status of the electronics for more than 1 s: supply and coil '
                'temperature are not known; check bus and electronics'
            )
        if self.sensor_fault:
            return (
                'the electronics report a fault of the displacement sensor (displacement_sensor is 1, must '
                'be 0): check the sensor and its cable'
            )
        return ''
