"""The electronics of the mount, simulated: current loop, ripple measurement, sensor noise, own watchdog."""

from typing import Annotated, NamedTuple

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1
from mount_models.arrays import FloatArray
from mount_models.quantity import Quantity
from mount_models.sampling import SETPOINT_TIMEOUT
from mount_sim.plant.reluctance import mean_incremental_inductance
from mount_sim.plant.ripple import current_rate, flux_rate
from mount_sim.random_numbers import RandomNumbers

STATUS_PERIOD = 0.1
"""s from one status to the next; the first sample has one."""


class ElectronicsParameters(NamedTuple):
    """The electronics' own numbers; noise and jitter are standard deviations."""

    current_bandwidth: Annotated[float, Quantity('Hz', 'bandwidth of the current loop', 10.0, 2000.0)] = 400.0
    setpoint_timeout: Annotated[
        float, Quantity('s', 'without a setpoint for so long the electronics go to 0 A', 0.001, 1.0)
    ] = SETPOINT_TIMEOUT
    displacement_noise: Annotated[float, Quantity('m', 'noise of the displacement sensor', 0.0, 1e-3)] = 2e-6
    sample_jitter: Annotated[
        float, Quantity('s', 'time of sampling the displacement, against its stamp', 0.0, 5e-4)
    ] = 0.0
    ripple_noise: Annotated[
        float, Quantity('1', 'noise of one ripple reading of the inductance, relative', 0.0, 0.5)
    ] = 0.01
    current_noise: Annotated[float, Quantity('A', 'noise of the mean current reading', 0.0, 0.1)] = 0.0
    clock_drift: Annotated[
        float, Quantity('1', "relative error of the electronics' clock in real time", -5e-4, 5e-4)
    ] = 0.0
    supply_voltage: Annotated[float, Quantity('V', 'supply as reported', 0.0, 60.0)] = 14.0
    coil_temperature: Annotated[
        float, Quantity('degC', 'temperature of coil and core, and as reported', -60.0, 250.0)
    ] = 20.0


def status_every(sample_rate: float) -> int:
    """Return the samples from one status to the next at `sample_rate` (Hz)."""
    return round(STATUS_PERIOD * sample_rate)


class Reading(NamedTuple):
    """One sample as the sensors give it, before it is coded for the bus; SI."""

    displacement: float
    coil_current: float
    current_rate: float
    flux_rate: float


class Noise:
    """Seeded standard normal numbers, `NUMBERS` for each sample, drawn in blocks."""

    NUMBERS = 5
    """Displacement, current, the two slopes, time of sampling: the last has a sequence of its own."""
    _BLOCK = 4096

    def __init__(self, seed: int, place: int | None = None):
        """`place`: the number of the mount where there are several; each has sequences of its own."""
        self._random = RandomNumbers(seed if place is None else (seed, 2, 1 + place))
        self._random_times = RandomNumbers((seed, 1) if place is None else (seed, 1, 1 + place))
        self._numbers: FloatArray = np.empty((0, self.NUMBERS))
        self._place = 0

    def next(self) -> FloatArray:
        """Return the numbers of the next sample."""
        numbers = self.ahead(1)[0]
        self.skip(1)
        return numbers

    def ahead(self, count: int) -> FloatArray:
        """Return the numbers of the next `count` samples, (count, NUMBERS); they remain the next."""
        while len(self._numbers) - self._place < count:
            times = self._random_times.normal(self._BLOCK, 1)
            drawn = np.hstack([self._random.normal(self._BLOCK, self.NUMBERS - 1), times])
            self._numbers = np.concatenate([self._numbers[self._place :], drawn])
            self._place = 0
        return self._numbers[self._place : self._place + count]

    def skip(self, count: int) -> None:
        """Go on by `count` samples whose numbers were looked at."""
        self._place += count


_NO_CURRENT = 1e-9  # A: an exponential decay ends here, before it costs time as a denormal number


@compiled
def read_sensors(electronics, coil, actuator, displacement, velocity, current, gap, noise):
    """Return (displacement m, current A, di/dt A/s, dB/dt T/s) as measured; `noise` as in `Noise`.

    The two slopes share the noise of the ripple reading evenly, so that their ratio has `ripple_noise`. A
    displacement sampled late has moved on by its `velocity` (m/s).
    """
    share = electronics.ripple_noise * np.sqrt(0.5)
    sampled = displacement + velocity * (electronics.sample_jitter * noise[4])
    return (
        sampled + electronics.displacement_noise * noise[0],
        current + electronics.current_noise * noise[1],
        current_rate(coil, actuator, current, gap) * (1.0 + share * noise[2]),
        flux_rate(coil, actuator, current) * (1.0 + share * noise[3]),
    )


@compiled
def advance_current(electronics, coil, actuator, current, gap, wanted, dt):
    """Return the coil current (A) after `dt` s of the current loop, within what the link voltage allows.

    The loop sets the voltage that would close the error with its bandwidth; slow changes of flux
    reach the whole core, so the inductance is the mean incremental one. Motion adds no voltage here. The
    mean rate over the step makes the decay exact: by its first value the loop would be 7 % too fast.
    """
    inductance = mean_incremental_inductance(actuator, current, gap)
    decayed = -expm1(-2.0 * np.pi * electronics.current_bandwidth * dt)
    rate = decayed / dt * (wanted - current)
    voltage = coil.resistance * current + inductance * rate
    voltage = min(max(voltage, -coil.link_voltage), coil.link_voltage)
    after = current + dt * (voltage - coil.resistance * current) / inductance
    return after if after > _NO_CURRENT else 0.0
