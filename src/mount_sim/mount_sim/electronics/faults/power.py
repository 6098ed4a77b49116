"""Faults of the power stage and of what the electronics report of themselves."""

import math
from typing import TYPE_CHECKING

from mount_driver.protocol import Status
from mount_models.sampling import HIGHEST_CURRENT
from mount_sim.electronics.faults.contract import Fault, Occasion

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

_DEAD_SUPPLY = 0.05  # V, chosen: next to nothing, for the law of the ripple divides by it
_HALF = 0.5


class CoilOpen(Fault):
    """The coil carries no current."""

    def driven(self, wanted: float) -> float:
        return 0.0


class CoilHalf(Fault):
    """The coil carries half of the wanted current."""

    def driven(self, wanted: float) -> float:
        return _HALF * wanted


class CoilStuck(Fault):
    """The coil carries 3 A, whatever is wanted."""

    def driven(self, wanted: float) -> float:
        return HIGHEST_CURRENT


class CoilStuckOn(Fault):
    """The coil keeps the current that was wanted when the fault began, also when it is switched off."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._kept = math.nan

    def driven(self, wanted: float) -> float:
        if self._kept != self._kept:
            self._kept = wanted
        return self._kept


class _Supply(Fault):
    """The supply has another voltage; the status tells it and the current loop has it."""

    volts = 0.0

    def status(self, status: Status) -> Status:
        return status._replace(supply_voltage=self.volts)

    def plant(self, plant: 'Plant') -> 'Plant':
        return plant._replace(coil=plant.coil._replace(link_voltage=max(self.volts, _DEAD_SUPPLY)))


class Supply0(_Supply):
    """No supply of the power stage."""


class Supply5(_Supply):
    """A supply that is far too low."""

    volts = 5.0


class Supply9(_Supply):
    """The lowest supply that is allowed."""

    volts = 9.0


class Supply16(_Supply):
    """The highest supply that is allowed."""

    volts = 16.0


class Supply24(_Supply):
    """A supply that is far too high, as from a truck's battery."""

    volts = 24.0


class OverCurrent(Fault):
    """The status reports it."""

    def status(self, status: Status) -> Status:
        return status._replace(over_current=True)


class OverTemperature(Fault):
    """The status reports it."""

    def status(self, status: Status) -> Status:
        return status._replace(over_temperature=True)


class UnderVoltage(Fault):
    """The status reports it."""

    def status(self, status: Status) -> Status:
        return status._replace(under_voltage=True)


class DisplacementSensor(Fault):
    """The status reports it; the readings are marked as valid."""

    def status(self, status: Status) -> Status:
        return status._replace(displacement_sensor=True)


class Temperature250(Fault):
    """The status says so."""

    def status(self, status: Status) -> Status:
        return status._replace(coil_temperature_celsius=250.0)
