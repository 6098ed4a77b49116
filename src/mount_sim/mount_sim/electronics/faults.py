"""Faults that the simulated electronics can have for a while, to see the graph fail safely."""

import math
from typing import Annotated, NamedTuple

import can

from mount_models.quantity import ParameterError, Quantity
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
}


class FaultParameters(NamedTuple):
    """Which fault, and when in simulated time."""

    kind: str = 'none'
    start: Annotated[float, Quantity('s', 'when the fault begins', 0.0, 7200.0, 'chosen')] = 0.0
    duration: Annotated[float, Quantity('s', 'how long it lasts', 0.0, 7200.0, 'chosen')] = 0.5


class Fault:
    """One fault, present from `start` for `duration` s of simulated time."""

    def __init__(self, parameters: FaultParameters):
        if parameters.kind not in FAULTS:
            raise ParameterError(f'fault {parameters.kind!r} is unknown; known are {", ".join(FAULTS)}')
        self._parameters = parameters
        self._stuck = math.nan

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
