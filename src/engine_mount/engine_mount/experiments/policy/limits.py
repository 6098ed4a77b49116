"""What no policy can beat: an ideal viscous damper, always on or on so long after the wheel meets the gap."""

from typing import NamedTuple

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION
from engine_mount.experiments.policy.runs import first_extremum
from engine_mount.experiments.sweep.evaluation import FIRST_FREQUENCY, RATE, peak_in
from engine_mount.reports.drive.signals import FloatArray
from mount_models.arithmetic.compiled import compiled
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.road import Gap, gap_in_road, sweep_road
from mount_sim.excitation.scenario import STEP_TIME, SweepScenario
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, vehicle_step

_STEPS = round(SAMPLE_TIME / STEP_TIME)
_SPEED, _GAP_LENGTH, _GAP_SECONDS = 33.0, 1.0, 1.0  # m/s, m, s
_SWEEP_SECONDS = (BELOW_ISOLATION[1] - FIRST_FREQUENCY) / RATE


class GapLimit(NamedTuple):
    """Largest displacement and first extremum (m) over a gap."""

    peak_m: float
    first_m: float


@compiled
def _damped(vehicle, state, road, damping, first, dt, displacement, every):
    """Fill `displacement` (m) at each `every`-th step; the damper (N s/m) is on from step `first` on."""
    velocity = 0.0
    for k in range(road.size):
        force = damping * velocity if k >= first else 0.0
        motion = vehicle_step(vehicle, state[0], road[k], 0.0, force, dt)
        velocity = motion.velocity
        if k % every == 0:
            displacement[k // every] = motion.displacement


def damped(road: FloatArray, damping: float, first: int = 0) -> FloatArray:
    """Return the displacement (m) at 1 kHz over a road (m) at the plant's step."""
    displacement = np.zeros(-(-road.size // _STEPS))
    _damped(Vehicle(), resting_vehicle(), road, damping, first, STEP_TIME, displacement, _STEPS)
    return displacement


def sweep_limit(level: float, damping: float) -> float:
    """Return the largest displacement (m) from 3 to 14 Hz with an ideal damper always on."""
    time = STEP_TIME * np.arange(round(_SWEEP_SECONDS / STEP_TIME))
    displacement = damped(sweep_road(time, SweepScenario(velocity_amplitude=level)), damping)
    frequency = FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(displacement.size)
    return peak_in(frequency, displacement, BELOW_ISOLATION) or float('nan')


def gap_limit(depth: float, damping: float, delay: float) -> GapLimit:
    """Return what a damper leaves that is on `delay` s after the wheel meets the gap, on a smooth road."""
    time = STEP_TIME * np.arange(round(_GAP_SECONDS / STEP_TIME))
    road = gap_in_road(time, Gap(depth=depth, position=0.0, length=_GAP_LENGTH, speed=_SPEED))
    displacement = damped(road, damping, round(delay / STEP_TIME))
    return GapLimit(float(np.abs(displacement).max()), first_extremum(displacement))
