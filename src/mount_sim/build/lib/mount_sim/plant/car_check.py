"""Is the step short enough for an engine on several mounts? As `mount_sim.plant.check` does it for one."""

import numpy as np
from numpy.typing import NDArray

from mount_models.quantity import ParameterError
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.car import CarMemory, advance_car
from mount_sim.plant.check import GROWTH_ALLOWED
from mount_sim.plant.plant import STATE

_SHIFT = 1e-9  # SI, chosen: small for heights and angles, and for forces of branches


def check_car(memory: CarMemory, seat: Seat, step_time: float) -> None:
    """Raise `ParameterError` if in steps of `step_time` s a free motion about rest would grow without end."""
    if growth(memory, seat, step_time) > 1.0 + GROWTH_ALLOWED:
        raise ParameterError(
            f'in steps of {1e6 * step_time:g} us the motion of the simulated engine on its mounts would grow '
            'without end: set its masses and inertias (engine.*), its stiffnesses (vehicle.*) and places '
            'closer to their defaults'
        )


def growth(memory: CarMemory, seat: Seat, step_time: float) -> float:
    """Return by how much the fastest growing free motion about rest is greater after a step, 1 for not."""
    base = _after_a_step(memory, seat, step_time, None)
    columns = [(_after_a_step(memory, seat, step_time, place) - base) / _SHIFT for place in range(len(base))]
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


def _after_a_step(
    memory: CarMemory, seat: Seat, step_time: float, shifted: int | None
) -> NDArray[np.float64]:
    """Return what moves, one step after rest at 0 A with the number at `shifted` out of its place."""
    trial = memory.copy()
    parts = _moving(trial)
    if shifted is not None:
        for part in parts:
            if shifted < part.size:
                part.flat[shifted] += _SHIFT
                break
            shifted -= part.size
    nothing = np.zeros(1)
    advance_car(*trial, int(seat), nothing, nothing, np.zeros(0), step_time)
    return np.concatenate([part.ravel() for part in parts])


def _moving(memory: CarMemory) -> list[NDArray[np.float64]]:
    """Return views of the numbers that move; the fluid of a hydromount is checked where it stands alone."""
    displacements = memory.states.view(STATE)['displacement']
    return [memory.body.view(np.float64), memory.motions.view(np.float64), displacements]
