"""From a displacement sample to a coil current: a policy says which force, the force maker makes it.

The step in reading order is `_advance`; around it is what no policy need care for. It is compiled once for
each policy, with the policy's own functions and records in it.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control import force_maker, force_to_current
from mount_control.policy.contract import Policy, trace_dtype, trace_fields
from mount_control.settings import ControlSettings
from mount_models.arithmetic.compiled import compiled, specialised
from mount_models.arithmetic.record import record_bytes, record_dtype, record_type

FARTHEST_DISPLACEMENT = 1.0  # m, chosen: far beyond any range of a sensor, and far from an overflow
_EXPONENT = 0x7FF0000000000000  # bits that are all set where a float64 is no finite number


class Compiled(NamedTuple):
    """The controller with one policy: types of its records, and its compiled functions."""

    law: type[NamedTuple]
    state: np.dtype
    trace: np.dtype
    start: Callable[..., None]
    transfer: Callable[..., None]
    step: Callable[..., float]
    run: Callable[..., None]


class Tables(NamedTuple):
    """The tables that a control step looks up: that of the policy, and current (A) over normal force."""

    policy: NDArray[np.float64]
    current: NDArray[np.float64]


class Memory(NamedTuple):
    """The first arguments of the compiled `step`: bytes of law and state, tables, window of the policy."""

    law: NDArray[np.uint8]
    tables: Tables
    state: NDArray[np.uint8]
    window: NDArray[np.float64]


class ControlLaw:
    """All that a control step needs and does not change: made beforehand, taken by one controller."""

    def __init__(self, settings: ControlSettings, table: force_to_current.CurrentTable):
        self.compiled = compiled_with(settings.policy)
        sample_time = 1.0 / settings.parameters.sample_rate
        maker = force_maker.design(settings.friction, settings.contact, table.limits, sample_time)
        self.record = record_bytes(self.compiled.law(settings.design.law, maker))
        self.tables = Tables(settings.design.table, table.currents)
        self.window = np.zeros(settings.design.window)


class Controller:
    """The control law with its memory; the same compiled step serves node, lock-step and core runs."""

    def __init__(self, law: ControlLaw):
        self.compiled = law.compiled
        self._law, self._tables, self._window = law.record, law.tables, law.window
        self._state = np.zeros(1, self.compiled.state).view(np.uint8)
        self._state_record = self._state.view(self.compiled.state)[0]
        self._trace = np.zeros(1, self.compiled.trace).view(np.uint8)
        self._trace_record = self._trace.view(self.compiled.trace)[0]
        self.restart(0.0)

    @property
    def memory(self) -> Memory:
        """What the compiled `step` takes before trace and sample, for a compiled loop that calls it."""
        return Memory(self._law, self._tables, self._state, self._window)

    @property
    def trace(self) -> np.void:
        """The intermediates of the last step."""
        return self._trace_record

    @property
    def trace_bytes(self) -> bytes:
        """The intermediates of the last step as little-endian float64 numbers."""
        return self._trace.tobytes()

    @property
    def faults(self) -> int:
        """How often the memory was found to hold something that is no finite number, and was cleared."""
        return int(self._state_record['faults'])

    def restart(self, displacement: float) -> None:
        """Forget the past: a mount at rest at `displacement` (m), damping off."""
        self.compiled.start(self._law, self._state, self._window, displacement)

    def change(self, law: ControlLaw) -> None:
        """Go on with another law of the same policy, from the next sample on and without a jump.

        The policy carries its memory over, and where damping is on the current goes over to what the new law
        asks for within `force_maker.FADE_TIME`.
        """
        self.compiled.transfer(self._law, law.record, self._state, self._window, law.window)
        self._law, self._tables, self._window = law.record, law.tables, law.window

    def step(self, displacement: float, bridged_samples: int = 0) -> float:
        """Take one displacement sample in m and return the current setpoint in A.

        `bridged_samples` samples missing before it are replaced by a straight line. NaN and what lies
        beyond `FARTHEST_DISPLACEMENT` are answered with 0 A and leave no trace in the memory. Where the
        memory itself holds what is no finite number, the answer is 0 A, it is cleared as by `restart`, and
        that is counted in `faults`.
        """
        return self.compiled.step(
            self._law, self._tables, self._state, self._window, self._trace, displacement, bridged_samples
        )

    def run(
        self, displacement: NDArray[np.float64], traces: NDArray[np.void] | None = None
    ) -> NDArray[np.void]:
        """Take n displacement samples in m and return n traces; bit-identical to n calls of `step`.

        They are written into `traces`, n records `compiled.trace` in a row, where it is given.
        """
        if traces is None:
            traces = np.zeros(len(displacement), self.compiled.trace)
        samples = np.ascontiguousarray(displacement, dtype=float)
        self.compiled.run(self._law, self._tables, self._state, self._window, traces.view(np.uint8), samples)
        return traces


def load_compiled_law(settings: ControlSettings) -> None:
    """Run the compiled law once, so that the first sample need not wait for the compiler."""
    table = force_to_current.resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    controller = Controller(ControlLaw(settings, table))
    controller.step(0.0)
    controller.run(np.zeros(1))
    controller.change(ControlLaw(settings, table))


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
    for function in (_rest, _refuse, _clear, _advance, _step, _start, _transfer, _single, _run):
        bound[function.__name__] = specialised(function, policy.__name__, bound)
    functions = (bound[name] for name in ('_start', '_transfer', '_single', '_run'))
    return Compiled(law, state, trace, *functions)


# What follows is compiled for each policy, with these names as `compiled_with` binds them.

policy: Any = None
LAW = STATE = TRACE = np.dtype([])
FIELDS = 0  # of a trace


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
    sound = _all_finite(bits)
    for index in range(len(displacements)):
        records = law_record, state_record, trace_records[index]
        _step(records, tables, bits, sound, window, traces, index, displacements[index], 0)
        sound = sound or abs(displacements[index]) <= FARTHEST_DISPLACEMENT  # a step leaves no other memory


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
    trace.displacement = displacement
    trace.velocity = (displacement - state.displacement) / law.maker.sample_time
    state.displacement = displacement

    force, velocity, active = policy.step(
        law.policy, tables.policy, state.policy, window, trace, displacement
    )
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
    """Return whether `bits` are those of finite float64, and of int64 that are not negative."""
    spoiled = 0
    for place in range(len(bits)):  # without a branch, so that several are looked at in one instruction
        spoiled |= (bits[place] & _EXPONENT) == _EXPONENT
    return spoiled == 0
