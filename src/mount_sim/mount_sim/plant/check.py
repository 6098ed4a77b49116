"""Do the parameters of a plant fit together, or would its motion grow without end in steps of this length?

The plant's own step is linearised about rest, so nothing of it is written a second time: each number of what
moves is shifted a little, and what becomes of it in one step is a column of the matrix of the step. Where an
eigenvalue of that lies outside the unit circle, a motion grows from step to step.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.record import record_bytes
from mount_models.friction.contact import check_friction
from mount_models.quantity import ParameterError, flattened, quantities, with_flattened
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.car import CarMemory, advance_car
from mount_sim.plant.mounts import Contents
from mount_sim.plant.plant import STATE, Plant, advance

GROWTH_ALLOWED = 1e-6
"""Of a motion in one step, chosen: far above rounding, 2 % in a second."""

_BISECTIONS = 30
_SHIFT, _SHIFT_OF_CAR = 1e-6, 1e-9  # SI, chosen: small for heights, angles and forces of branches
_SHIFTS = {'volume': 1e-12, 'flow': 1e-9}  # m^3, m^3/s (chosen): within one piece of the hydromount's laws
_MOVING = ('vehicle', 'engine', 'hydromount', 'displacement')
_NOTHING = np.zeros(1)

FloatArray = NDArray[np.float64]


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


def check_car(memory: CarMemory, seat: Seat, step_time: float) -> None:
    """Raise `ParameterError` if in steps of `step_time` s a motion of the engine would grow without end."""
    if car_growth(memory, seat, step_time) > 1.0 + GROWTH_ALLOWED:
        raise ParameterError(
            f'in steps of {1e6 * step_time:g} us the motion of the simulated engine on its mounts would grow '
            'without end: set its masses and inertias (engine.*), its stiffnesses (vehicle.*) and places '
            'closer to their defaults'
        )


def growth(plant: Plant, seat: Seat, step_time: float) -> float:
    """Return by how much the fastest growing free motion about rest is greater after a step, 1 for not."""
    law, rest = record_bytes(plant), np.zeros(STATE.itemsize // 8)
    rest.view(STATE)['gap'] = plant.mechanics.rest_gap
    places = {place: name for part in _MOVING for place, name in _numbers(STATE, part)}

    def step(state: FloatArray) -> FloatArray:
        advance(law, state.view(np.uint8), int(seat), _NOTHING, _NOTHING, 0.0, step_time)
        return state

    shifts = [next((by for word, by in _SHIFTS.items() if word in name), _SHIFT) for name in places.values()]
    return _growth(step, rest, list(places), shifts)


def car_growth(memory: CarMemory, seat: Seat, step_time: float) -> float:
    """Return the same for an engine on several mounts; the fluid of each is checked where it stands alone."""
    body, rest = memory.body.size, memory.body.size + memory.motions.size
    ((displacement, _),) = _numbers(STATE, 'displacement')
    whole = np.concatenate([memory.body, memory.motions, memory.states]).view(np.float64)
    displacements = range(rest // 8 + displacement, whole.size, STATE.itemsize // 8)

    def step(state: FloatArray) -> FloatArray:
        numbers = state.view(np.uint8)
        trial = memory._replace(body=numbers[:body], motions=numbers[body:rest], states=numbers[rest:])
        advance_car(*trial, int(seat), _NOTHING, _NOTHING, np.zeros(0), step_time)
        return state

    moving = [*range(rest // 8), *displacements]
    return _growth(step, whole, moving, [_SHIFT_OF_CAR] * len(moving))


def _growth(
    step: Callable[[FloatArray], FloatArray], rest: FloatArray, moving: list[int], shifts: Sequence[float]
) -> float:
    """Return the greatest eigenvalue of a `step`, which changes its state in place, for what is `moving`."""
    base = step(rest.copy())[moving]
    columns = []
    for place, shift in zip(moving, shifts, strict=True):
        state = rest.copy()
        state[place] += shift
        columns.append((step(state)[moving] - base) / shift)
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


def _numbers(kind: np.dtype, part: str) -> list[tuple[int, str]]:
    """Return place among all numbers and name of those in a part of a record."""
    fields: Mapping[str, Any] = kind.fields or {}
    field, offset = fields[part][:2]
    return [(offset // 8 + k, name) for k, name in enumerate(field.names or (part,))]


# Which parameter it is.


def _is_stable(plant: Plant, seat: Seat, step_time: float) -> bool:
    return growth(plant, seat, step_time) <= 1.0 + GROWTH_ALLOWED


def _culprit(plant: Plant, seat: Seat, step_time: float) -> str:
    """Return the parameter that does it alone, with the limit at which it would not, or all that may."""
    values, defaults = flattened(plant), flattened(Plant())
    parts = ('vehicle.', 'hydromount.')
    changed = [name for name in values if name.startswith(parts) and values[name] != defaults[name]]
    for name in changed:
        good, bad = defaults[name], values[name]
        if not _is_stable(with_flattened(plant, {name: good}), seat, step_time):
            continue
        for _ in range(_BISECTIONS):
            middle = 0.5 * (good + bad)
            if _is_stable(with_flattened(plant, {name: middle}), seat, step_time):
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


def _unit(plant: Plant, path: str) -> str:
    parameters: Any = plant
    *outer, name = path.split('.')
    for part in outer:
        parameters = getattr(parameters, part)
    return quantities(parameters)[name].unit
