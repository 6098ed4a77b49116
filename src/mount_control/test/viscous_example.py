"""A policy as small as can be, the worked example of docs/how-to/extending.md: a viscous damper, always on.

To ship it, it would be `mount_control/policy/viscous_example.py`, with one line in `policy/registry.py`.
"""

from typing import Annotated, NamedTuple

from mount_control.policy.contract import Design
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.quantity import Quantity


class Parameters(NamedTuple):
    """What can be set: `viscous_example.damping_coefficient` on ROS."""

    damping_coefficient: Annotated[
        float, Quantity('N s/m', 'wanted force over velocity', 0.0, 10_000.0, 'chosen')
    ] = 1000.0


class Law(NamedTuple):
    """Numbers that a step needs: N s/m, s."""

    damping_coefficient: float
    sample_time: float


STATE = record_type([('displacement', 'f8')])
TRACE = {'predicted_velocity': 'm/s'}


def design(parameters: Parameters, sample_time: float) -> Design:
    """Return the law of these parameters."""
    return Design(Law(parameters.damping_coefficient, sample_time))


@compiled
def start(law, state, window, displacement):
    """Set the memory to a mount at rest at `displacement` (m)."""
    state.displacement = displacement


@compiled
def transfer(law, new_law, state, window, new_window):
    """Keep the memory: other parameters mean nothing else by it."""


@compiled
def step(law, table, state, window, trace, displacement, crank_frequency):
    """Take one sample (m); return force (N), velocity (m/s), and that damping is on."""
    velocity = (displacement - state.displacement) / law.sample_time
    state.displacement = displacement
    trace.predicted_velocity = velocity
    return law.damping_coefficient * velocity, velocity, 1.0
