"""The closed loop without middleware, many samples in one compiled call.

It calls, in the order of the wire, what the simulated mount, the bus and the controller do anyway; there
is no law in it. Samples that need a judgement end it: the caller takes them one by one.
"""

import functools
import math
from collections.abc import Callable
from typing import Any

from mount_control.controller import compiled_with
from mount_control.plausibility import doubt_of
from mount_control.policy.contract import Policy
from mount_models.arithmetic.compiled import compiled, specialised
from mount_sim.plant import plant
from mount_sim.quantisation import (
    quantised_coil_current,
    quantised_current_rate,
    quantised_displacement,
    quantised_flux_rate,
    quantised_setpoint_current,
)


@compiled
def over_the_bus(displacement, coil_current, current_rate, flux_rate):
    """Return a reading (m, A, A/s, T/s) as it arrives; NaN where it has no place in the message."""
    current_rate = quantised_current_rate(current_rate)
    flux_rate = quantised_flux_rate(flux_rate)
    if math.isnan(current_rate) or math.isnan(flux_rate):
        current_rate = flux_rate = math.nan  # the two slopes share one validity bit
    return (
        quantised_displacement(displacement),
        quantised_coil_current(coil_current),
        current_rate,
        flux_rate,
    )


@functools.cache
def run_with(policy: Policy) -> Callable[..., tuple[int, float, float]]:
    """Return `_run` compiled with a policy."""
    return specialised(_run, policy.__name__, {'policy': policy, 'step': compiled_with(policy).step})


step: Any = None  # of the controller; bound by `run_with`


def _run(ahead, memory, plausibility, believable, frequencies, pending, readings, setpoints, truths, traces):
    """Take samples until one displacement is not believed; return (number taken, setpoints in A).

    The two setpoints are the one that has arrived for the next sample and the one taken over last.

    `ahead` is what the plant gives for n samples, `memory` that of the controller, `plausibility` limits and
    memory of the check of the displacement, `believable` its largest value (m), `frequencies` (n,) the Hz of
    the crankshaft, `pending` the setpoint (A) that arrived before the first sample. Filled for each sample
    taken: `readings` (n, 4) as they arrive, `setpoints` (n,) in A as they leave, `truths` and `traces`
    (n, bytes of their records).
    """
    last, mount = pending, ahead.memory
    limits, known = plausibility
    before = known.copy()
    for index in range(len(setpoints)):
        displacement, coil_current, current_rate, flux_rate = plant.read(
            mount.plant, mount.state, truths[index], ahead.noise[index]
        )
        reading = over_the_bus(displacement, coil_current, current_rate, flux_rate)
        if not abs(reading[0]) <= believable:  # also NaN
            return index, pending, last
        before[:] = known
        if doubt_of(limits, known, reading[0], 0):
            known[:] = before
            return index, pending, last
        setpoint = step(
            memory.law, memory.tables, memory.state, memory.window, traces[index], reading[0], 0,
            frequencies[index],
        )  # fmt: skip
        for place in range(4):
            readings[index, place] = reading[place]
        setpoints[index] = setpoint
        current = 0.0 if ahead.driver_open else pending
        values, forces = ahead.values[index], ahead.engine_forces[index]
        plant.advance(mount.plant, mount.state, mount.seat, values, forces, current, mount.step_time)
        last, pending = pending, quantised_setpoint_current(setpoint)
    return len(setpoints), pending, last
