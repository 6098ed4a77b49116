"""From a displacement sample to a coil current: a policy says which force, the force maker makes it.

The step in reading order is `_step`; policy and force maker have their place in `_advance`. All of it is
compiled once for each policy, with its functions and records in it: written out it would stand twice.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control import force_maker
from mount_control.policy.contract import Policy, trace_dtype
from mount_control.settings import ControlSettings
from mount_models.arithmetic.compiled import compiled, specialised
from mount_models.arithmetic.record import record_bytes, record_dtype, record_type

FAULT_SENTENCE = (
    'controller state became NaN or infinite: output 0 A, state reset; set friction.* and contact.* of '
    'mount_control closer to their defaults'
)
"""The message about a controller that has found its memory spoiled."""
FARTHEST_DISPLACEMENT = 1.0  # m, chosen: far beyond any range of a sensor, and far from an overflow
_EXPONENT = 0x7FF0000000000000  # bits that are all set where a float64 is no finite number


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


class Compiled(NamedTuple):
    """The controller with one policy: types of its records, and its compiled functions."""

    law: type[NamedTuple]
    state: np.dtype
    trace: np.dtype
    start: Callable[..., None]
    transfer: Callable[..., None]
    step: Callable[..., float]
    run: Callable[..., None]


class ControlLaw:
    """All that a control step needs and does not change: made beforehand, used by one controller."""

    def __init__(self, settings: ControlSettings, table: force_maker.CurrentTable):
        self.compiled = compiled_with(settings.policy)
        sample_time = 1.0 / settings.parameters.sample_rate
        fade = round(force_maker.FADE_TIME / sample_time)
        maker = force_maker.Law(settings.friction, settings.contact, table.limits, sample_time, fade)
        self.record = record_bytes(self.compiled.law(settings.design.law, maker))
        self.tables = Tables(settings.design.table, table.currents)
        self.window = np.zeros(settings.design.window)


class Controller:
    """A control law with its memory; it knows neither stamps nor doubts, see `control_loop`."""

    def __init__(self, law: ControlLaw):
        self.compiled = law.compiled
        state = np.zeros(1, self.compiled.state).view(np.uint8)
        self.counts = state.data.cast('q')
        """The state as integers; the last one counts the faults."""
        self.trace_record = np.zeros(1, self.compiled.trace).view(np.uint8)
        """The bytes of the trace of the last step."""
        self.trace: np.void = self.trace_record.view(self.compiled.trace)[0]
        self._use(Memory(law.record, law.tables, state, law.window))
        self.restart(0.0)

    def _use(self, memory: Memory) -> None:
        self.memory = memory
        self.advance = functools.partial(self.compiled.step, *memory, self.trace_record)
        """`step` without a call between."""

    @property
    def faults(self) -> int:
        """How often the memory was found to hold NaN or infinity, and was cleared."""
        return self.counts[-1]

    def restart(self, displacement: float) -> None:
        """Forget the past: a mount at rest at `displacement` (m), damping off."""
        self.compiled.start(*self.memory, displacement)

    def change(self, law: ControlLaw) -> None:
        """Continue with another law of the same policy, from the next sample on and without a jump.

        The policy carries its memory over, and while damping the current moves to that of the new law
        within `force_maker.FADE_TIME`.
        """
        old, _, state, window = self.memory
        self.compiled.transfer(old, law.record, state, window, law.window)
        self._use(Memory(law.record, law.tables, state, law.window))

    def step(self, displacement: float, bridged_samples: int = 0, crank_frequency: float = 0.0) -> float:
        """Take one displacement sample in m and return the current setpoint in A.

        `bridged_samples` samples missing before it are replaced by a straight line. `crank_frequency`: turns
        of the crankshaft in a second (Hz), unknown where it is not finite and above 0. NaN and displacements
        beyond `FARTHEST_DISPLACEMENT` are answered with 0 A and leave no trace in the memory. Where the
        memory itself holds NaN or infinity, the answer is 0 A, the memory is cleared as by `restart`, and
        `faults` counts it.
        """
        return self.advance(displacement, bridged_samples, crank_frequency)

    def run(
        self,
        displacement: NDArray[np.float64],
        traces: NDArray[np.void] | None = None,
        crank_frequency: NDArray[np.float64] | float = 0.0,
    ) -> NDArray[np.void]:
        """Take n displacement samples in m and return n traces; bit-identical to n calls of `step`.

        They are written into `traces`, n records `compiled.trace` in a row, where it is given.
        `crank_frequency` (n,) or one for all, in Hz.
        """
        if traces is None:
            traces = np.zeros(len(displacement), self.compiled.trace)
        samples = np.ascontiguousarray(displacement, dtype=float)
        frequencies = np.array(np.broadcast_to(crank_frequency, samples.shape), dtype=float)
        self.compiled.run(*self.memory, traces.view(np.uint8), samples, frequencies)
        return traces


def load_compiled_law(settings: ControlSettings) -> None:
    """Run the compiled law once, so that the first sample need not wait for the compiler."""
    table = force_maker.resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    law = ControlLaw(settings, table)
    controller = Controller(law)
    controller.step(0.0)
    controller.run(np.zeros(1))
    controller.change(law)


@functools.cache
def compiled_with(policy: Policy) -> Compiled:
    """Return the controller compiled with a policy; compiled on the first call of each function."""
    law = NamedTuple('law', [('policy', policy.Law), ('maker', force_maker.Law)])  # noqa: UP014
    state = record_type(
        [('policy', policy.STATE), ('maker', force_maker.STATE), ('displacement', 'f8'), ('faults', 'i8')]
    )
    trace = trace_dtype(policy)
    bound: dict[str, Any] = {'policy': policy, 'LAW': record_dtype(law), 'STATE': state, 'TRACE': trace}
    bound['OF_TRACE'] = len(trace)
    for function in (_rest, _refuse, _clear, _advance, _step):
        bound[function.__name__] = specialised(function, policy.__name__, bound)
    interface = (specialised(each, policy.__name__, bound) for each in (_start, _transfer, _single, _run))
    return Compiled(law, state, trace, *interface)


# What follows is compiled for each policy, with these names as `compiled_with` binds them. A `mount` is its
# law, tables, state, the bits of the state, and window.

policy: Any = None
LAW = STATE = TRACE = np.dtype([])
OF_TRACE = 0  # numbers


def _start(law, tables, state, window, displacement):
    """Set the memory to a mount at rest at `displacement` (m), damping off; arguments as for `_single`."""
    _rest((law.view(LAW)[0], tables, state.view(STATE)[0], state.view(np.int64), window), displacement)


def _transfer(law, new_law, state, window, new_window):
    """Make the memory of one law that of a new one; arguments are the bytes of records and two windows."""
    memory = state.view(STATE)[0]
    policy.transfer(law.view(LAW)[0].policy, new_law.view(LAW)[0].policy, memory.policy, window, new_window)
    force_maker.begin_fade(new_law.view(LAW)[0].maker, memory.maker)


def _single(law, tables, state, window, trace, displacement, bridged_samples, crank_frequency):
    """Take one displacement sample (m) and the Hz of the crankshaft, fill `trace`, return the setpoint in A.

    `law`, `state` and `trace` are the bytes of their records.
    """
    mount = law.view(LAW)[0], tables, state.view(STATE)[0], state.view(np.int64), window
    sound = _all_finite(mount[3])
    numbers, record = trace.view(np.float64), trace.view(TRACE)[0]
    return _step(mount, sound, numbers, record, displacement, bridged_samples, crank_frequency)


def _run(law, tables, state, window, traces, displacements, frequencies):
    """Fill `traces` with one step for each displacement (m) and frequency (Hz); see `_single`."""
    mount = law.view(LAW)[0], tables, state.view(STATE)[0], state.view(np.int64), window
    sound = _all_finite(mount[3])
    records, numbers = traces.view(TRACE), traces.view(np.float64)
    for place in range(len(displacements)):
        of_sample = numbers[place * OF_TRACE : (place + 1) * OF_TRACE]
        _step(mount, sound, of_sample, records[place], displacements[place], 0, frequencies[place])
        sound = sound or abs(displacements[place]) <= FARTHEST_DISPLACEMENT


def _step(mount, sound, numbers, trace, displacement, bridged_samples, crank_frequency):
    """Take one sample; `numbers` are those of `trace`, `sound`: whether all of the state are finite."""
    _, _, state, bits, _ = mount
    if not abs(displacement) <= FARTHEST_DISPLACEMENT:  # also NaN
        return _refuse(numbers, trace, displacement, crank_frequency)
    if not sound:
        return _clear(mount, numbers, trace, displacement, crank_frequency)
    known = _known(crank_frequency)
    rise = (displacement - state.displacement) / (bridged_samples + 1)
    for _ in range(bridged_samples):
        _advance(mount, trace, state.displacement + rise, known)
    trace.crank_frequency, trace.bridged_samples = known, bridged_samples
    if not (_advance(mount, trace, displacement, known) and _all_finite(bits)):
        return _clear(mount, numbers, trace, displacement, crank_frequency)
    return trace.current


def _advance(mount, trace, displacement, crank_frequency):
    """Let policy and force maker take one sample; return whether all results are finite numbers."""
    law, tables, state, _, window = mount
    trace.displacement = displacement
    trace.velocity = (displacement - state.displacement) / law.maker.sample_time
    state.displacement = displacement
    force, velocity, active = policy.step(
        law.policy, tables.policy, state.policy, window, trace, displacement, crank_frequency
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


def _rest(mount, displacement):
    law, _, state, bits, window = mount
    faults = state.faults
    bits[:] = 0
    state.faults = faults
    window[:] = 0.0
    policy.start(law.policy, state.policy, window, displacement)
    state.displacement = displacement


def _clear(mount, numbers, trace, displacement, crank_frequency):
    """Begin afresh with a memory that was spoiled: whatever the cause, no current is made of it."""
    _rest(mount, displacement)
    mount[2].faults += 1
    return _refuse(numbers, trace, displacement, crank_frequency)


def _refuse(numbers, trace, displacement, crank_frequency):
    """Trace that nothing but its inputs is known of a step, and 0 A."""
    numbers[:] = np.nan
    trace.displacement, trace.crank_frequency = displacement, _known(crank_frequency)
    trace.damping_active = trace.desired_force = trace.normal_force = trace.current = 0.0
    trace.bridged_samples = 0.0
    return 0.0


@compiled
def _known(crank_frequency):
    """Return a frequency (Hz), 0.0 for what is none: NaN, negative or infinite."""
    return crank_frequency if crank_frequency > 0.0 and math.isfinite(crank_frequency) else 0.0


@compiled
def _all_finite(bits):
    """Return whether `bits` are those of finite float64, and of int64 that are not negative.

    One by one: to load several at once, a processor waits until the last ones written are in its cache.
    """
    for place in range(len(bits)):  # noqa: SIM110 - numba compiles no generator
        if (bits[place] & _EXPONENT) == _EXPONENT:
            return False
    return True
