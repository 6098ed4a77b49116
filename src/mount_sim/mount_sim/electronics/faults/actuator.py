"""Faults of coil, magnet and pads: the plant has other parameters while they last."""

import math
from typing import TYPE_CHECKING

from mount_driver.protocol import Status
from mount_sim.electronics.faults.contract import Fault, Occasion
from mount_sim.electronics.warm_coil import REFERENCE_CELSIUS, TemperatureCoefficients

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

_SOUND_TURNS = 0.5  # share, chosen: the others are shorted
_HOTTER = 0.4  # 1: rise of the resistance
_WORN = 200e-6  # m, chosen: contact gap; less is left of the pads than the air gap of 349 um needs
_HALVES_MEET = 20e-6  # m, chosen: gap at which the core halves touch where no pad is between them
_BLOCKING = 1e9  # N/m, chosen: stiffness of what lies between the halves


class CoilShorted(Fault):
    """Half of the turns are shorted: half of the resistance, a quarter of the inductance and of the force.

    The current in the shorted turns is left out.
    """

    def plant(self, plant: 'Plant') -> 'Plant':
        return plant._replace(
            coil=plant.coil._replace(resistance=_SOUND_TURNS * plant.coil.resistance),
            actuator=plant.actuator._replace(turns=_SOUND_TURNS * plant.actuator.turns),
        )


class CoilHot(Fault):
    """Coil and core are so warm that the copper resists 40 % more than at 20 degC, and the status says so."""

    def __init__(self, occasion: Occasion):
        super().__init__(occasion)
        self._celsius = math.nan

    def status(self, status: Status) -> Status:
        return status._replace(coil_temperature_celsius=self._celsius)

    def plant(self, plant: 'Plant') -> 'Plant':
        copper = plant.temperature.copper or TemperatureCoefficients().copper
        self._celsius = REFERENCE_CELSIUS + _HOTTER / copper
        return plant._replace(electronics=plant.electronics._replace(coil_temperature=self._celsius))


class PadsWorn(Fault):
    """So little is left of the pads that they touch at a gap of 200 um only."""

    def plant(self, plant: 'Plant') -> 'Plant':
        return plant._replace(mechanics=plant.mechanics._replace(contact_gap=_WORN))


class PadsMissing(Fault):
    """The core halves meet, and nothing rubs."""

    def plant(self, plant: 'Plant') -> 'Plant':
        return plant._replace(
            mechanics=plant.mechanics._replace(contact_gap=_HALVES_MEET),
            friction=plant.friction._replace(scale=0.0),
        )


class GapBlocked(Fault):
    """Something lies between the core halves: they do not move, and nothing presses on the pads."""

    def plant(self, plant: 'Plant') -> 'Plant':
        return plant._replace(mechanics=plant.mechanics._replace(spring_stiffness=_BLOCKING))
