"""Do the parameters of a plant fit together, or would its motion grow without end in steps of this length?

The plant's own step is linearised about rest, so nothing of it is written a second time: each number of what
moves is shifted a little, and what becomes of it in one step is a column of the matrix of the step. Where an
eigenvalue of that lies outside the unit circle, a motion grows from step to step.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.record import record_bytes
from mount_models.friction.coefficient_check import check_friction
from mount_models.quantity import ParameterError, flattened, quantities, with_flattened
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.mounts import Contents
from mount_sim.plant.plant import STATE, Plant, advance
from mount_sim.plant.vehicle import Engine

GROWTH_ALLOWED = 1e-6
"""Of a motion in one step, chosen: far above rounding, 2 % in a second."""

_BISECTIONS = 30
_SHIFTS = {'volume': 1e-12, 'flow': 1e-9}  # m^3, m^3/s (chosen): within one piece of the hydromount's laws
_SHIFT = 1e-6  # of all others, SI, chosen
_MOVING = ('vehicle', 'engine', 'hydromount', 'displacement')


def checked_plant(plant: Plant, seat: Seat, step_time: float) -> Plant:
    """Return `plant` if it can be simulated in steps of `step_time` s, or raise a `ValueError` that says why.

    Checked are combinations; each number by itself is checked where the plant is made.
    """
    if plant.mount.contents == Contents.PADS:
        check_friction(plant.friction, plant.contact)
    if not _is_stable(plant, seat, step_time):
        raise ParameterError(
            f'{_culprit(plant, seat, step_time)}: in steps of {1e6 * step_time:g} us the motion of the '
            'simulated plant would grow without end'
        )
    return plant


def growth(plant: Plant, seat: Seat, step_time: float) -> float:
    """Return by how much the fastest growing free motion about rest is greater after a step, 1 for not."""
    law, moving = record_bytes(plant), list(_numbers(STATE))
    base = _after_a_step(law, plant, seat, step_time, None)
    columns = [(_after_a_step(law, plant, seat, step_time, name) - base) / _shift(name) for name in moving]
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


def _is_stable(plant: Plant, seat: Seat, step_time: float) -> bool:
    return growth(plant, seat, step_time) <= 1.0 + GROWTH_ALLOWED


def _after_a_step(
    law: NDArray[np.uint8], plant: Plant, seat: Seat, step_time: float, shifted: str | None
) -> NDArray[np.float64]:
    """Return what moves, one step after rest at 0 A with the number `shifted` out of its place."""
    state = np.zeros(1, STATE)
    state['gap'] = plant.mechanics.rest_gap
    if shifted is not None:
        record, name = _place(state, shifted)
        record[name] += _shift(shifted)
    nothing = np.zeros(1)
    advance(law, state.view(np.uint8), int(seat), nothing, nothing, 0.0, step_time)
    places = (_place(state, name) for name in _numbers(STATE))
    return np.array([record[name][0] for record, name in places])


def _numbers(kind: np.dtype, prefix: str = '') -> Iterator[str]:
    for name in kind.names or ():
        if prefix or name in _MOVING:
            nested = kind[name].names is not None
            yield from _numbers(kind[name], f'{prefix}{name}.') if nested else [prefix + name]


def _place(state: NDArray[Any], path: str) -> tuple[NDArray[Any], str]:
    *outer, name = path.split('.')
    for part in outer:
        state = state[part]
    return state, name


def _shift(name: str) -> float:
    return next((shift for word, shift in _SHIFTS.items() if word in name), _SHIFT)


# Which parameter it is.


def _culprit(plant: Plant, seat: Seat, step_time: float) -> str:
    """Return the parameter that does it alone, with the limit at which it would not, or all that may."""
    values, defaults = _values(plant), _values(Plant())
    changed = [name for name, value in values.items() if value != defaults[name]]
    for name in changed:
        good, bad = defaults[name], values[name]
        if not _is_stable(_with(plant, name, good), seat, step_time):
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (good + bad)
            if _is_stable(_with(plant, name, middle), seat, step_time):
                good = middle
            else:
                bad = middle
        side = 'below' if values[name] > defaults[name] else 'above'
        unit = _unit(plant, name)
        return (
            f'{name} ({values[name]:g} {unit}) must lie {side} {good:.4g} {unit} with all others as they are'
        )
    told = ', '.join(f'{name} ({values[name]:g} {_unit(plant, name)})' for name in changed)
    return f'{told} do not fit together; set them closer to their defaults'


def _values(plant: Plant) -> dict[str, float]:
    return {**flattened(plant.vehicle, 'vehicle'), **flattened(plant.hydromount, 'hydromount')}


def _with(plant: Plant, name: str, value: float) -> Plant:
    vehicle = with_flattened(plant.vehicle, {name: value}, 'vehicle')
    return plant._replace(
        vehicle=vehicle,
        engine=Engine(vehicle.engine_mass, vehicle.elastomer),
        hydromount=with_flattened(plant.hydromount, {name: value}, 'hydromount'),
    )


def _unit(plant: Plant, path: str) -> str:
    parameters: Any = plant
    *outer, name = path.split('.')
    for part in outer:
        parameters = getattr(parameters, part)
    return quantities(parameters)[name].unit
