"""Damper characteristics: the friction force that control asks for, as a table over speed.

Each law is one class: it gives the force magnitude above a dead zone, in which no force is asked for, so that
the pads do not stick (Sec. 5). `damper_curve` turns a name, a law or points of one's own into a table with a
uniform grid; what a parameter says, it says as a text, and here alone texts are understood.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import yaml

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1
from mount_models.arithmetic.sums import each_interpolated
from mount_models.arrays import FloatArray
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import ParameterError, Quantity, check_name, checked, nearest

SMALLEST_DEAD_ZONE = 0.0001
"""A dead zone is none at all or at least this wide (m/s, chosen), because it sets the grid of the table."""
LONGEST_VELOCITY_STEP = 0.0005
"""Grid of the table (m/s, chosen), so that bent laws are met within 0.01 N."""
STEP_OF_POINTS = 0.0001
"""Grid of the table of an own characteristic (m/s, chosen), whose corners lie anywhere."""
COLUMNS = ('velocity', 'force')
"""Names of the columns, m/s and N."""
HIGHEST_VELOCITY = 1.0
"""A characteristic ends here (m/s, chosen): twenty times the peak velocity of 8 Hz with 1 mm."""
HIGHEST_FORCE = 1e4
"""N, chosen: far more than friction at the highest current."""
MOST_POINTS = 10_000
_VISCOUS = re.compile(r'viscous_(\d+(\.\d*)?([eE][+-]?\d+)?)')


@dataclass(frozen=True)
class DamperCurve:
    """Force magnitudes `table` (n,) in N at the speeds 0, `velocity_step`, 2 `velocity_step`, ... in m/s."""

    name: str
    table: FloatArray
    velocity_step: float

    def force(self, velocity: npt.ArrayLike) -> FloatArray:
        """Return the force (N), of the sign of `velocity` (m/s, any shape)."""
        speeds = np.asarray(velocity, float)
        forces = [damper_force(self.table, self.velocity_step, speed) for speed in speeds.ravel()]
        return np.array(forces).reshape(speeds.shape)


@compiled
def damper_force(table, velocity_step, velocity):
    """Return the force (N) at `velocity` (m/s), odd in it and constant beyond the end of the table."""
    place = abs(velocity) / velocity_step
    last = table.size - 1
    if place >= last:
        magnitude = table[last]
    elif place >= 0.0:
        node = int(place)
        magnitude = table[node] + (place - node) * (table[node + 1] - table[node])
    else:  # not a number
        return velocity
    return -magnitude if velocity < 0.0 else magnitude


_DampingCoefficient = Annotated[
    float, Quantity('N s/m', 'c_d: slope of force over velocity just above the dead zone', 1.0, 1e5)
]
_DeadZone = Annotated[
    float, Quantity('m/s', 'velocity magnitude up to which no force is asked for', 0.0, 0.1)
]
_ForceLimit = Annotated[float, Quantity('N', 'largest force magnitude asked for', 1.0, 1e4)]


class ViscousDamper(NamedTuple):
    """Force c_d (|v| - dead zone), the characteristic of the paper (Sec. 5); values chosen."""

    damping_coefficient: _DampingCoefficient = 2000.0
    dead_zone: _DeadZone = 0.004
    force_limit: _ForceLimit = 300.0

    def magnitude(self, excess_velocity: FloatArray) -> FloatArray:
        """Return the force (N) at velocity magnitudes above the dead zone (m/s, >= 0)."""
        return self.damping_coefficient * excess_velocity


class DegressiveDamper(NamedTuple):
    """Force F_0 (1 - exp(-c_d (|v| - dead zone) / F_0)), for strong damping of small motions (chosen)."""

    damping_coefficient: _DampingCoefficient = 4000.0
    dead_zone: _DeadZone = 0.004
    force_limit: _ForceLimit = 300.0
    final_force: Annotated[float, Quantity('N', 'F_0: force that high velocities approach', 1.0, 1e4)] = 120.0

    def magnitude(self, excess_velocity: FloatArray) -> FloatArray:
        """Return the force (N) at velocity magnitudes above the dead zone (m/s, >= 0)."""
        exponents = self.damping_coefficient / self.final_force * excess_velocity
        return -self.final_force * np.array([expm1(-exponent) for exponent in exponents])


class ProgressiveDamper(NamedTuple):
    """Force c_d w (1 + w / w_0), w = |v| - dead zone, for soft damping of small motions (chosen)."""

    damping_coefficient: _DampingCoefficient = 1000.0
    dead_zone: _DeadZone = 0.004
    force_limit: _ForceLimit = 300.0
    doubling_velocity: Annotated[
        float, Quantity('m/s', 'w_0: above the dead zone, velocity with twice the viscous force', 0.001, 10.0)
    ] = 0.040

    def magnitude(self, excess_velocity: FloatArray) -> FloatArray:
        """Return the force (N) at velocity magnitudes above the dead zone (m/s, >= 0)."""
        return self.damping_coefficient * excess_velocity * (1.0 + excess_velocity / self.doubling_velocity)


DAMPER_LAWS: dict[str, Any] = {
    'viscous': ViscousDamper,
    'degressive': DegressiveDamper,
    'progressive': ProgressiveDamper,
}

DAMPERS: dict[str, Any] = {
    **{f'viscous_{slope}000': ViscousDamper(1000.0 * slope) for slope in range(1, 5)},
    'degressive': DegressiveDamper(),
    'progressive': ProgressiveDamper(),
}
"""The characteristics with a name of their own."""

_KNOWN = (
    f'{", ".join(DAMPERS)}, viscous_<N s/m>, a law such as {{law: viscous, dead_zone: 0.002}}, or points '
    f'{{{COLUMNS[0]}: [0, 0.1], {COLUMNS[1]}: [0, 200]}}'
)


def damper_curve(choice: Any) -> DamperCurve:
    """Return the curve of a text, a law, or a mapping: of a law and its parameters, or of points.

    A text is a name in `DAMPERS`, `viscous_<N s/m>`, or a mapping in YAML.
    A mapping is such as {'law': 'viscous', 'dead_zone': 0.002}; what it leaves out has its default; or
    {'velocity': [...], 'force': [...]} in m/s and N, joined by straight lines and constant behind the last.
    Raises `ParameterError` if it is unknown or unusable, `ParameterError` for a value outside its range.
    """
    if isinstance(choice, str):
        return _curve_of_text(choice)
    if isinstance(choice, Mapping):
        if 'law' not in choice and set(choice) & set(COLUMNS):
            return _curve_of_points('points', *_checked_points(choice))
        return _tabulated(str(choice.get('law')), _law_of(choice))
    return _tabulated(type(choice).__name__, choice)


def damper_text(choice: str | Mapping[str, Any]) -> str:
    """Return the text, in one line, that means what `choice` means."""
    if isinstance(choice, Mapping):
        return yaml.safe_dump(dict(choice), default_flow_style=True, sort_keys=False, width=1 << 30).strip()
    return choice


def _curve_of_text(text: str) -> DamperCurve:
    if text in DAMPERS:
        return _tabulated(text, DAMPERS[text])
    if viscous_text := _VISCOUS.fullmatch(text):
        return _tabulated(text, ViscousDamper(float(viscous_text[1])))
    try:
        mapping = plain_yaml(text)
    except YamlError as error:
        raise ParameterError(f'damper {text!r:.60} {error}; known by name are {_KNOWN}') from None
    if isinstance(mapping, Mapping):
        return damper_curve(mapping)
    raise ParameterError(f'no damper curve is called {text!r:.60}; known are {_KNOWN}')


def _curve_of_points(name: str, velocity: FloatArray, force: FloatArray) -> DamperCurve:
    grid = np.arange(math.floor(velocity[-1] / STEP_OF_POINTS * (1.0 + 1e-12)) + 1) * STEP_OF_POINTS
    table = each_interpolated(grid, velocity, force)
    if not table.max() > 0.0:
        raise ParameterError(f'the points of the damper {name} must reach beyond {STEP_OF_POINTS:g} m/s')
    table.flags.writeable = False
    return DamperCurve(name, table, STEP_OF_POINTS)


def _law_of(values: Mapping[str, Any]) -> Any:
    given = dict(values)
    name = given.pop('law', None)
    if name not in DAMPER_LAWS:
        raise ParameterError(f'no damper law is called {name!r}; {nearest(name, DAMPER_LAWS)}')
    law = DAMPER_LAWS[name]
    for each in given:
        check_name(f'the {name} damper', each, law._fields)
    return law(**given)


def _tabulated(name: str, law: Any) -> DamperCurve:
    law = checked(law)
    if 0.0 < law.dead_zone < SMALLEST_DEAD_ZONE:
        raise ParameterError(
            f'dead_zone ({law.dead_zone:g} m/s) of the damper {name} must be 0 or at least '
            f'{SMALLEST_DEAD_ZONE:g} m/s; choose 0 for none'
        )
    step = _velocity_step(law.dead_zone)
    velocities = np.arange(round(HIGHEST_VELOCITY / step) + 1) * step
    edge = round(law.dead_zone / step)
    force = law.magnitude(np.maximum(velocities - edge * step, 0.0))
    # the table ends below the limit, because a node cut down to it would bend the last piece
    within = int(np.searchsorted(force, law.force_limit * (1.0 + 1e-12), side='right'))
    table = force[:within].copy()
    if not table[-1] > 0.0:
        raise ParameterError(
            f'force_limit ({law.force_limit:g} N) of the damper {name} must be reached more than one grid '
            f'step ({step:g} m/s) above the dead zone; raise the limit or lower damping_coefficient'
        )
    table.flags.writeable = False
    return DamperCurve(name, table, step)


def _velocity_step(dead_zone: float) -> float:
    """Return the grid step (m/s) that makes the edge of the dead zone, a corner of the curve, a node."""
    if dead_zone == 0.0:
        return LONGEST_VELOCITY_STEP
    return dead_zone / math.ceil(dead_zone / LONGEST_VELOCITY_STEP)


def _checked_points(columns: Any) -> tuple[FloatArray, FloatArray]:
    """Return velocities (m/s) and forces (N), (n,), of a mapping with both columns; raises `ParameterError`.

    The characteristic is odd, so both are magnitudes. It begins without force, else the pads would chatter.
    """
    if not isinstance(columns, Mapping) or sorted(map(str, columns)) != sorted(COLUMNS):
        raise ParameterError(
            f'the points of a damper must have the columns {" and ".join(COLUMNS)}, m/s and N'
        )
    velocity, force = (_numbers(name, columns[name]) for name in COLUMNS)
    if velocity.size != force.size or not 2 <= velocity.size <= MOST_POINTS:
        raise ParameterError(
            f'velocity ({velocity.size} numbers) and force ({force.size} numbers) must be equally long, '
            f'2 to {MOST_POINTS} points'
        )
    if velocity[0] < 0.0 or velocity[-1] > HIGHEST_VELOCITY or not (np.diff(velocity) > 0.0).all():
        raise ParameterError(
            f'velocity ({velocity[0]:g} .. {velocity[-1]:g} m/s) must rise strictly within '
            f'0 .. {HIGHEST_VELOCITY:g} m/s; give magnitudes, the characteristic is odd'
        )
    if force[0] != 0.0 or force.min() < 0.0 or not 0.0 < force.max() <= HIGHEST_FORCE:
        raise ParameterError(
            f'force ({force[0]:g} N at first, {force.min():g} .. {force.max():g} N) must begin at 0 N, lie '
            f'within 0 .. {HIGHEST_FORCE:g} N and be greater than 0 N somewhere; friction only opposes motion'
        )
    return velocity, force


def _numbers(name: str, values: Any) -> FloatArray:
    try:
        numbers = np.array(values, float)
    except (TypeError, ValueError):
        numbers = np.empty(())
    if numbers.ndim != 1 or not np.isfinite(numbers).all():
        raise ParameterError(f'{name} must be a list of finite numbers; instead received {values!r:.60}')
    return numbers
