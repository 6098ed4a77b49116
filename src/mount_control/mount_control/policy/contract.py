"""What a policy declares, and what it can rely on.

A policy looks at the displacement sample by sample and says which friction force is wanted, at which
velocity it will act, and whether to damp at all. The rest is the same for all: `force_maker` turns the force
into a current within its limits, `controller` refuses what is no displacement, bridges missing samples by a
straight line (one `step` for each) and clears a memory that holds NaN or infinity.

The names that each policy's module has:

`Parameters`
    NamedTuple with defaults; numbers as `Annotated[float, Quantity(...)]`, or texts. On ROS they are called
    `<name of the policy>.<parameter>`, those of `switched_viscous` by their own name alone.
`Law`
    NamedTuple of numbers, or of such: what `design` works out of the parameters.
`STATE`
    `record_type` of the memory, of `f8` and `i8`; the latter never negative, at least one field.
`TRACE`
    {field: unit} of the policy's own intermediates, all `f8`, one of them `predicted_velocity`, the velocity
    at which the force acts, and none that every policy has. Those in m or m/s are 0 at the first sample after
    `start` at its displacement: so a replay finds where the controller began.
`design(parameters, sample_time) -> Design`
    Plain Python; what it makes has the same time constants at every `sample_time` (s). Raises a
    `ValueError` with value, limit and remedy for what cannot work together.

and compiled, with the records of `Law` and `STATE`:

`start(law, state, window, displacement)`
    State and window are 0: set what is not in a mount at rest at `displacement` (m), damping off.
`transfer(law, new_law, state, window, new_window)`
    Make the memory that of other parameters, without a jump.
`step(law, table, state, window, trace, displacement, crank_frequency) -> (force, velocity, active)`
    Take one sample (m) and fill the own fields of `trace`. `crank_frequency` (Hz): turns of the crankshaft
    in a second, 0.0 where they are not known, never NaN or negative. `force` (N) is the wanted friction
    force, signed like `velocity` (m/s), for which the law of friction is solved: that at which the force
    acts, or a larger one where a reversal is near and the law would fade. `active` lies within 0 .. 1, and
    at exactly 0 the current is exactly 0 A.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.record import record_type

_BEFORE = {'displacement': 'm', 'velocity': 'm/s', 'crank_frequency': 'Hz'}
_BEHIND = {
    'damping_active': '1',
    'desired_force': 'N',
    'friction_deflection': 'm',
    'friction_coefficient': '1',
    'normal_force': 'N',
    'current': 'A',
    'bridged_samples': '1',
}


class Design(NamedTuple):
    """A law, a `table` (n,) that it looks up, and how many numbers of memory it needs as a `window`."""

    law: Any
    table: NDArray[np.float64] = np.zeros(0)
    window: int = 0


class Policy(Protocol):
    """A module that declares a policy, see above."""

    Parameters: Any
    Law: Any
    STATE: np.dtype
    TRACE: Mapping[str, str]
    design: Callable[[Any, float], Design]
    start: Callable[..., None]
    transfer: Callable[..., None]
    step: Callable[..., tuple[float, float, float]]


def trace_fields(policy: Policy) -> dict[str, str]:
    """Return {name: unit} of all that is traced of one step with this policy, in the order of the message."""
    return {**_BEFORE, **policy.TRACE, **_BEHIND}


def trace_dtype(policy: Policy) -> np.dtype:
    """Return the record type of one traced step."""
    return record_type([(name, 'f8') for name in trace_fields(policy)])
