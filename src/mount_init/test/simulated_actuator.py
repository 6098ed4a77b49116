"""A simulated actuator with coil, springs and pads, behind the same samples and setpoints as the real one."""

import math
from collections.abc import Callable

import numba
import numpy as np

from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import Initialisation, InitialisationResult
from mount_init.parameters import InitParameters
from mount_models.specimen import Specimen, default_specimen
from mount_sim.plant.closing import ClosingMechanics, closed_state
from mount_sim.plant.reluctance import ReluctanceActuator, mean_incremental_inductance
from mount_sim.plant.ripple import RippleCoil, TemperatureCoefficients, coil_at, current_rate, flux_rate

SPECIMEN = default_specimen()
SAMPLE_TIME_NS = 1_000_000
STEPS_PER_SAMPLE = 10
LOOP_BANDWIDTH = 2.0 * math.pi * 400.0  # rad/s

Sample = tuple[float, float, float]


# compiled afresh: a cache on disk would tie this file to the folder that pytest was started in
@numba.njit(error_model='numpy')
def advance(state, setpoint, mechanics, actuator, coil, supply, time_step, bandwidth, steps):
    """Move current state[0] (A) and gap state[1] (m) on by `steps`; the loop is limited by the voltage."""
    for _ in range(steps):
        inductance = mean_incremental_inductance(actuator, state[0], state[1])
        voltage = coil.resistance * state[0] + bandwidth * inductance * (setpoint - state[0])
        voltage = min(max(voltage, -supply), supply)
        state[0] += time_step * (voltage - coil.resistance * state[0]) / inductance
        state[1] = closed_state(mechanics, actuator, state[0], state[1])[0]


class SimulatedActuator:
    """The truth behind the samples; `distort(number, sample) -> sample` injects faults into what is read.

    `supply` (V) limits the current loop alone, `noise` is the relative scatter of L_i of each
    ripple; core and coil are at `celsius` (degC).
    """

    def __init__(
        self,
        contact_gap: float = 349e-6,
        rest_gap: float = 508e-6,
        noise: float = 0.0,
        seed: int = 0,
        supply: float = 14.0,
        celsius: float = 20.0,
        distort: Callable[[int, Sample], Sample] | None = None,
    ):
        self.mechanics = ClosingMechanics(contact_gap=contact_gap, rest_gap=rest_gap)
        self.actuator = ReluctanceActuator()
        self.coil = coil_at(RippleCoil(), TemperatureCoefficients(), celsius)
        self.supply = supply
        self.state = np.array([0.0, rest_gap])
        self.number = 0
        self._noise = noise
        self._random = np.random.default_rng(seed)
        self._distort = distort

    def sample(self) -> Sample:
        """Return mean current (A), its slope (A/s) and that of flux density (T/s) as they are read."""
        current, gap = float(self.state[0]), float(self.state[1])
        rate = current_rate(self.coil, self.actuator, current, gap)
        if self._noise:
            rate /= 1.0 + self._noise * self._random.standard_normal()
        sample = (current, rate, flux_rate(self.coil, self.actuator, current))
        return self._distort(self.number, sample) if self._distort else sample

    def follow(self, setpoint: float) -> None:
        """Let one sample time pass with this setpoint (A)."""
        time_step = 1e-9 * SAMPLE_TIME_NS / STEPS_PER_SAMPLE
        advance(
            self.state,
            setpoint,
            self.mechanics,
            self.actuator,
            self.coil,
            self.supply,
            time_step,
            LOOP_BANDWIDTH,
            STEPS_PER_SAMPLE,
        )
        self.number += 1

    def true_normal_force(self, currents: np.ndarray) -> np.ndarray:
        """Return the normal force (N) that settles at rising `currents` (A)."""
        gap, forces = self.mechanics.rest_gap, []
        for current in currents:
            gap, force = closed_state(self.mechanics, self.actuator, float(current), gap)
            forces.append(force)
        return np.array(forces)


def run_initialisation(
    plant: SimulatedActuator,
    specimen: Specimen = SPECIMEN,
    parameters: InitParameters | None = None,
    temperatures: TemperatureReadings | None = None,
) -> InitialisationResult:
    """Run a whole initialisation against `plant`, as plain function calls."""
    return run_ramp(plant, specimen, parameters, temperatures).result()


def run_ramp(
    plant: SimulatedActuator,
    specimen: Specimen = SPECIMEN,
    parameters: InitParameters | None = None,
    temperatures: TemperatureReadings | None = None,
) -> Initialisation:
    """Like `run_initialisation`, up to the end of the ramp."""
    initialisation = Initialisation(specimen, parameters or InitParameters(), temperatures)
    while not initialisation.finished:
        stamp = (plant.number + 1) * SAMPLE_TIME_NS
        plant.follow(initialisation.step(stamp, *plant.sample()))
    return initialisation
