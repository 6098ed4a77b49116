"""Faults that the simulated electronics can have for a while, to see the graph fail safely."""

import math
from typing import Annotated, Any, NamedTuple

import can

from mount_driver.codec import Status
from mount_models.quantity import ParameterError, Quantity
from mount_models.sampling import HIGHEST_CURRENT
from mount_sim.electronics.electronics import Reading

FAULTS = {
    'none': 'no fault',
    'silence': 'no frames are sent',
    'lost_frames': 'every third frame is not sent',
    'wrong_crc': 'every third frame is damaged on its way',
    'invalid_displacement': 'the displacement sensor marks its readings as not valid',
    'stuck_displacement': 'the displacement sensor repeats its last reading',
    'no_ripple': 'the ripple measurement gives nothing',
    'deaf': 'setpoints are not received',
    'coil_open': 'the coil carries no current',
    'coil_half': 'the coil carries half of the wanted current',
    'coil_stuck': 'the coil carries `fault.current`, whatever is wanted',
    'coil_stuck_on': 'the coil keeps the current that was wanted last, also when it is switched off',
    'over_current': 'the status reports it',
    'over_temperature': 'the status reports it',
    'under_voltage': 'the status reports it',
    'displacement_sensor': 'the status reports it; readings are marked as valid',
    'hot_coil': 'the status says 250 degC',
    'low_supply': 'the status says 5 V',
    'high_supply': 'the status says 24 V',
}
_STATUS: dict[str, dict[str, Any]] = {
    'over_current': {'over_current': True},
    'over_temperature': {'over_temperature': True},
    'under_voltage': {'under_voltage': True},
    'displacement_sensor': {'displacement_sensor': True},
    'hot_coil': {'coil_temperature_celsius': 250.0},
    'low_supply': {'supply_voltage': 5.0},
    'high_supply': {'supply_voltage': 24.0},
}


class FaultParameters(NamedTuple):
    """Which fault, and when in simulated time."""

    kind: str = 'none'
    start: Annotated[float, Quantity('s', 'when the fault begins', 0.0, 7200.0, 'chosen')] = 0.0
    duration: Annotated[float, Quantity('s', 'how long it lasts', 0.0, 7200.0, 'chosen')] = 0.5
    current: Annotated[float, Quantity('A', 'of `coil_stuck`', 0.0, HIGHEST_CURRENT, 'chosen')] = (
        HIGHEST_CURRENT
    )


class Fault:
    """One fault, present from `start` for `duration` s of simulated time."""

    def __init__(self, parameters: FaultParameters):
        if parameters.kind not in FAULTS:
            raise ParameterError(f'fault {parameters.kind!r} is unknown; known are {", ".join(FAULTS)}')
        self._parameters = parameters
        self._stuck = math.nan
        self._wanted_last = 0.0

    def present(self, time: float) -> bool:
        """Whether the fault is there at `time` (s)."""
        begin = self._parameters.start
        return self._parameters.kind != 'none' and begin <= time < begin + self._parameters.duration

    def deaf(self, time: float) -> bool:
        """Whether setpoints are lost at `time`."""
        return self._parameters.kind == 'deaf' and self.present(time)

    def reading(self, time: float, reading: Reading) -> Reading:
        """Return what the sensors give with the fault."""
        if not self.present(time):
            self._stuck = reading.displacement
            return reading
        changed = {
            'invalid_displacement': {'displacement': math.nan},
            'stuck_displacement': {'displacement': self._stuck},
            'no_ripple': {'current_rate': math.nan, 'flux_rate': math.nan},
        }
        return reading._replace(**changed.get(self._parameters.kind, {}))

    def driven(self, time: float, wanted: float) -> float:
        """Return the current (A) that the power stage drives where `wanted` (A) is asked of it."""
        if not self.present(time):
            self._wanted_last = wanted
            return wanted
        changed = {
            'coil_open': 0.0,
            'coil_half': 0.5 * wanted,
            'coil_stuck': self._parameters.current,
            'coil_stuck_on': self._wanted_last,
        }
        return changed.get(self._parameters.kind, wanted)

    def status(self, time: float, status: Status) -> Status:
        """Return what the electronics say of themselves with the fault."""
        return status._replace(**_STATUS.get(self._parameters.kind, {})) if self.present(time) else status

    def frame(self, time: float, number: int, frame: can.Message) -> can.Message | None:
        """Return what arrives of a frame with the fault; None if nothing does."""
        if not self.present(time):
            return frame
        kind = self._parameters.kind
        if kind == 'silence' or (kind == 'lost_frames' and number % 3 == 0):
            return None
        if kind == 'wrong_crc' and number % 3 == 0:
            frame.data[-1] ^= 0xFF
        return frame
