"""One step of the controller, and many: compiled once for each policy, with its functions and records in it.

The step in reading order is `_advance`; around it is what no policy need care for. Many steps are the same to
the bit, in an order that a processor does faster.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mount_control import force_maker
from mount_control.policy.contract import Policy, trace_dtype, trace_fields
from mount_models.arithmetic.compiled import compiled, specialised
from mount_models.arithmetic.record import record_dtype, record_type

FARTHEST_DISPLACEMENT = 1.0  # m, chosen: far beyond any range of a sensor, and far from an overflow
_EXPONENT = 0x7FF0000000000000  # bits that are all set where a float64 is no finite number
_AHEAD = 64  # samples, chosen: so far the policy is ahead of the force maker in a run


class Compiled(NamedTuple):
    """The controller with one policy: types of its records, and its compiled functions."""

    law: type[NamedTuple]
    state: np.dtype
    trace: np.dtype
    start: Callable[..., None]
    transfer: Callable[..., None]
    step: Callable[..., float]
    run: Callable[..., None]


@functools.cache
def compiled_with(policy: Policy) -> Compiled:
    """Return the controller compiled with a policy; compiled on the first call of each function."""
    law = NamedTuple('law', [('policy', policy.Law), ('maker', force_maker.Law)])  # noqa: UP014
    state = record_type(
        [('policy', policy.STATE), ('maker', force_maker.STATE), ('displacement', 'f8'), ('faults', 'i8')]
    )
    trace = trace_dtype(policy)
    bound: dict[str, Any] = {'policy': policy, 'LAW': record_dtype(law), 'STATE': state, 'TRACE': trace}
    bound['FIELDS'] = len(trace_fields(policy))
    bound['OF_POLICY'] = policy.STATE.itemsize // 8
    steps = (_rest, _refuse, _clear, _decide, _make, _advance, _step)
    for function in (*steps, _decide_ahead, _make_behind, _pass, _start, _transfer, _single, _run):
        bound[function.__name__] = specialised(function, policy.__name__, bound)
    functions = (bound[name] for name in ('_start', '_transfer', '_single', '_run'))
    return Compiled(law, state, trace, *functions)


# What follows is compiled for each policy, with these names as `compiled_with` binds them.

policy: Any = None
LAW = STATE = TRACE = np.dtype([])
FIELDS = 0  # of a trace
OF_POLICY = 0  # numbers of its state, with which that of the controller begins


def _start(law, state, window, displacement):
    """Set the memory to a mount at rest at `displacement` (m), damping off; arguments as for `_single`."""
    _rest(law.view(LAW)[0], state.view(STATE)[0], window, displacement)


def _transfer(law, new_law, state, window, new_window):
    """Make the memory of one law that of a new one; arguments are the bytes of records and two windows."""
    memory = state.view(STATE)[0]
    policy.transfer(law.view(LAW)[0].policy, new_law.view(LAW)[0].policy, memory.policy, window, new_window)
    force_maker.begin_fade(new_law.view(LAW)[0].maker, memory.maker)


def _single(law, tables, state, window, trace, displacement, bridged_samples):
    """Take one displacement sample (m), fill `trace`, return the current setpoint in A.

    `law`, `state` and `trace` are the bytes of their records.
    """
    records, bits = (law.view(LAW)[0], state.view(STATE)[0], trace.view(TRACE)[0]), state.view(np.int64)
    sound = _all_finite(bits)
    return _step(records, tables, bits, sound, window, trace, 0, displacement, bridged_samples)


def _run(law, tables, state, window, traces, displacements):
    """Fill `traces` with one step for each displacement; arguments as for `_single`."""
    law_record, state_record, trace_records = law.view(LAW)[0], state.view(STATE)[0], traces.view(TRACE)
    bits = state.view(np.int64)
    sound, answers = _all_finite(bits), np.empty((3, _AHEAD))
    for begin in range(0, len(displacements), _AHEAD):
        samples = displacements[begin : begin + _AHEAD]
        mount = law_record, tables, state_record, bits, window
        if sound and _pass(mount, trace_records[begin : begin + _AHEAD], samples, answers):
            continue
        for index in range(begin, begin + len(samples)):
            records = law_record, state_record, trace_records[index]
            _step(records, tables, bits, sound, window, traces, index, displacements[index], 0)
            sound = sound or abs(displacements[index]) <= FARTHEST_DISPLACEMENT  # a step leaves no other


def _pass(mount, traces, displacements, answers):
    """Take samples as single steps would, first all by the policy, then all by the force maker.

    The processor overlaps the steps of either, but not of both in turn. At the first that is to be refused,
    or that spoils the memory, this is as it was before, and False is returned. `answers`, (3, samples), is
    overwritten.
    """
    bits, window = mount[3], mount[4]
    state_before, window_before = bits.copy(), window.copy()
    if _decide_ahead(mount, traces, displacements, answers) and _make_behind(mount, traces, answers):
        return True
    bits[:], window[:] = state_before, window_before
    return False


def _decide_ahead(mount, traces, displacements, answers):
    """Let the policy take samples; return whether all that came out, and its state, are finite numbers."""
    law, tables, state, bits, window = mount
    for index in range(len(displacements)):
        if not abs(displacements[index]) <= FARTHEST_DISPLACEMENT:  # also NaN
            return False
        force, velocity, active = _decide(law, tables, state, window, traces[index], displacements[index])
        answers[0, index], answers[1, index], answers[2, index] = force, velocity, active
        if not (math.isfinite(force + velocity + active) and _all_finite(bits[:OF_POLICY])):
            return False
    return True


def _make_behind(mount, traces, answers):
    """Let the force maker take what the policy wants; return whether all that came out is finite."""
    law, tables, state, bits, _ = mount
    for index in range(len(traces)):
        trace = traces[index]
        trace.bridged_samples = 0
        force, velocity, active = answers[0, index], answers[1, index], answers[2, index]
        sound = _make(law, tables, state, trace, force, velocity, active)
        if not (sound and _all_finite(bits[OF_POLICY:])):
            return False
    return True


def _step(records, tables, bits, sound, window, traces, index, displacement, bridged_samples):
    """Take one sample; `bits` are those of the state, the trace stands at `index` in the bytes `traces`.

    `sound`: whether all numbers of the state are finite.
    """
    law, state, trace = records
    if not abs(displacement) <= FARTHEST_DISPLACEMENT:  # also NaN
        return _refuse(trace, traces, index, displacement)
    if not sound:
        return _clear(records, window, traces, index, displacement)
    rise = (displacement - state.displacement) / (bridged_samples + 1)
    for _ in range(bridged_samples):
        _advance(law, tables, state, window, trace, state.displacement + rise)
    trace.bridged_samples = bridged_samples
    sound = _advance(law, tables, state, window, trace, displacement)
    if not (sound and _all_finite(bits)):
        return _clear(records, window, traces, index, displacement)
    return trace.current


def _advance(law, tables, state, window, trace, displacement):
    """Take one sample; return whether what came out are finite numbers."""
    force, velocity, active = _decide(law, tables, state, window, trace, displacement)
    return _make(law, tables, state, trace, force, velocity, active)


def _decide(law, tables, state, window, trace, displacement):
    """Let the policy take one sample; return what its `step` returns."""
    trace.displacement = displacement
    trace.velocity = (displacement - state.displacement) / law.maker.sample_time
    state.displacement = displacement
    return policy.step(law.policy, tables.policy, state.policy, window, trace, displacement)


def _make(law, tables, state, trace, force, velocity, active):
    """Let the force maker make what the policy wants; return whether what came out are finite numbers."""
    normal_force, coefficient, current = force_maker.make(
        law.maker, tables.current, state.maker, force, velocity, active
    )
    trace.damping_active = active
    trace.desired_force = force
    trace.friction_deflection = state.maker.deflection
    trace.friction_coefficient = coefficient
    trace.normal_force = normal_force
    trace.current = current
    return 0.0 <= active <= 1.0 and math.isfinite(force + velocity + current)


def _rest(law, state, window, displacement):
    policy.start(law.policy, state.policy, window, displacement)
    force_maker.rest(state.maker)
    state.displacement = displacement


def _clear(records, window, traces, index, displacement):
    """Begin afresh with a memory that was spoiled: whatever has done it, no current is made of it."""
    law, state, trace = records
    _rest(law, state, window, displacement)
    state.faults += 1
    return _refuse(trace, traces, index, displacement)


def _refuse(trace, traces, index, displacement):
    """Trace that nothing is known of a step, and 0 A."""
    traces.view(np.float64)[index * FIELDS : (index + 1) * FIELDS] = np.nan
    trace.displacement = displacement
    trace.damping_active = 0.0
    trace.desired_force = 0.0
    trace.normal_force = 0.0
    trace.current = 0.0
    trace.bridged_samples = 0.0
    return 0.0


@compiled
def _all_finite(bits):
    """Return whether `bits` are those of finite float64, and of int64 that are not negative.

    One by one: to load several at once, a processor waits until the last ones written are in its cache.
    """
    for place in range(len(bits)):  # noqa: SIM110 - numba compiles no generator
        if (bits[place] & _EXPONENT) == _EXPONENT:
            return False
    return True
