"""What follows from each bit and value of `MountStatus`: the coil off, at 0 A for a while, or a warning.

No bus and no clock here; times are ns by the clock that judges ages (`Clock.now`).
"""

from typing import Annotated, NamedTuple

from mount_driver.codec import Status
from mount_models.quantity import Quantity

_OFF = {
    'over_current': 'check coil, cable and power stage for a short circuit',
    'over_temperature': 'let the coil cool down',
    'under_voltage': 'check battery, generator and wiring',
}


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
    """Keeps the newest status and when it came."""

    def __init__(self, limits: StatusLimits):
        self._limits = limits
        self._timeout = round(1e9 * limits.timeout)
        self._status: Status | None = None
        self._heard: int | None = None  # time of the newest status, or of the first look

    def judge(self, status: Status, now: int) -> str:
        """Take a status; return why the coil is to be off until the next initialisation, else empty."""
        self._status, self._heard = status, now
        voltage, celsius = status.supply_voltage, status.coil_temperature_celsius
        limits = self._limits
        for name, remedy in _OFF.items():
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
        if self._heard is None:
            self._heard = now
        if now - self._heard > self._timeout:
            missing = f'no status of the electronics for more than {self._limits.timeout:g} s'
            return f'{missing}: supply and coil temperature are not known; check bus and electronics'
        if self._status is not None and self._status.displacement_sensor:
            fault = 'a fault of the displacement sensor (displacement_sensor is 1, must be 0)'
            return f'the electronics report {fault}: check the sensor and its cable'
        return ''
