"""From a displacement sample to a coil current: the control of Fig. 12 in reading order."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control import band_pass, force_to_current, switching
from mount_control.settings import ControlSettings
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype, record_type
from mount_models.damper import damper_force
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import normal_force_for, simplified_step
from mount_models.sampling import SAMPLE_TIME

FADE_SAMPLES = 50
"""Samples (chosen, 50 ms) in which the current goes over to a new law: first it stands for a sample, and its
distance from what the new law asks for then falls evenly to zero."""
FARTHEST_DISPLACEMENT = 1.0  # m, chosen: far beyond any range of a sensor, and far from an overflow

TRACE = record_type(
    [
        (name, 'f8')
        for name in (
            'displacement',
            'velocity',
            'band_displacement',
            'band_velocity',
            'predicted_velocity',
            'magnitude',
            'damping_active',
            'desired_force',
            'friction_deflection',
            'friction_coefficient',
            'normal_force',
            'current',
            'bridged_samples',
        )
    ]
)
"""Every intermediate of one control step, SI; the fields of the topic `control_trace` in its order."""

_STATE = record_type(
    [
        ('band', band_pass.STATE),
        ('switching', switching.STATE),
        ('displacement', 'f8'),
        ('deflection', 'f8'),
        ('normal_force', 'f8'),
        ('current', 'f8'),
        ('distance', 'f8'),
        ('fading', 'i8'),
        ('faults', 'i8'),
    ]
)


class Law(NamedTuple):
    """The numbers that a control step needs and does not change."""

    band: band_pass.BandPass
    switching: switching.Switching
    damper_step: float
    friction: FrictionCoefficients
    contact: FrictionContact
    limits: force_to_current.CurrentLimits


_LAW = record_dtype(Law)


class Tables(NamedTuple):
    """The tables that a control step looks up: damper force (N) over velocity, current (A) over force."""

    damper: NDArray[np.float64]
    current: NDArray[np.float64]


class Memory(NamedTuple):
    """The first arguments of the compiled `step`: bytes of law and state, tables, window of the magnitude."""

    law: NDArray[np.uint8]
    tables: Tables
    state: NDArray[np.uint8]
    window: NDArray[np.float64]


class ControlLaw:
    """All that a control step needs and does not change: made beforehand, taken by one controller."""

    def __init__(self, settings: ControlSettings, table: force_to_current.CurrentTable):
        parameters, damper = settings.parameters, settings.damper
        law = Law(
            band_pass.design(
                parameters.eigenfrequency, parameters.quality, parameters.lead_time, SAMPLE_TIME
            ),
            switching.chosen_switching(parameters),
            damper.velocity_step,
            settings.friction,
            settings.contact,
            table.limits,
        )
        self.record = record_bytes(law)
        self.tables = Tables(damper.table, table.currents)
        self.window = np.zeros(parameters.period_samples)


class Controller:
    """The control law with its memory; the same compiled step serves node, lock-step and core runs."""

    def __init__(self, law: ControlLaw):
        self._law, self._tables, self._window = law.record, law.tables, law.window
        self._state = np.zeros(1, _STATE).view(np.uint8)
        self._state_record = self._state.view(_STATE)[0]
        self._trace = np.zeros(1, TRACE).view(np.uint8)
        self._trace_record = self._trace.view(TRACE)[0]
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
        start(self._law, self._state, self._window, displacement)

    def change(self, law: ControlLaw) -> None:
        """Go on with another law, from the next sample on and without a jump; a law is taken once.

        The band-pass goes on from the same last samples, magnitude and switching keep their past, and where
        damping is on the current goes over to what the new law asks for within `FADE_SAMPLES`.
        """
        transfer(self._law, law.record, self._state, self._window, law.window)
        self._law, self._tables, self._window = law.record, law.tables, law.window

    def step(self, displacement: float, bridged_samples: int = 0) -> float:
        """Take one displacement sample in m and return the current setpoint in A.

        `bridged_samples` samples missing before it are replaced by a straight line. NaN and what lies
        beyond `FARTHEST_DISPLACEMENT` are answered with 0 A and leave no trace in the memory. Where the
        memory itself holds what is no finite number, the answer is 0 A, it is cleared as by `restart`, and
        that is counted in `faults`.
        """
        return step(
            self._law, self._tables, self._state, self._window, self._trace, displacement, bridged_samples
        )

    def run(
        self, displacement: NDArray[np.float64], traces: NDArray[np.void] | None = None
    ) -> NDArray[np.void]:
        """Take n displacement samples in m and return n traces; bit-identical to n calls of `step`.

        They are written into `traces`, n records `TRACE` in a row, where it is given.
        """
        if traces is None:
            traces = np.zeros(len(displacement), TRACE)
        samples = np.ascontiguousarray(displacement, dtype=float)
        run(self._law, self._tables, self._state, self._window, traces.view(np.uint8), samples)
        return traces


def load_compiled_law(settings: ControlSettings) -> None:
    """Run the compiled law once, so that the first sample need not wait for the compiler."""
    table = force_to_current.resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    controller = Controller(ControlLaw(settings, table))
    controller.step(0.0)
    controller.run(np.zeros(1))
    controller.change(ControlLaw(settings, table))


@compiled
def transfer(law, new_law, state, window, new_window):
    """Make the memory of one law that of a new one; arguments are the bytes of records and two windows."""
    memory = state.view(_STATE)[0]
    band_pass.transfer(law.view(_LAW)[0].band, new_law.view(_LAW)[0].band, memory.band)
    switching.transfer(memory.switching, window, new_window)
    memory.fading = FADE_SAMPLES if memory.switching.active == 1 else 0


@compiled
def start(law, state, window, displacement):
    """Set the memory to a mount at rest at `displacement` (m), damping off; arguments as for `step`."""
    _rest(law.view(_LAW)[0], state.view(_STATE)[0], window, displacement)


@compiled
def _rest(law, state, window, displacement):
    band_pass.settle(law.band, state.band, displacement)
    switching.rest(state.switching, window)
    state.displacement = displacement
    state.deflection = 0.0
    state.normal_force = 0.0
    state.current = 0.0
    state.fading = 0
    state.distance = 0.0


@compiled
def step(law, tables, state, window, trace, displacement, bridged_samples):
    """Take one displacement sample (m), fill `trace`, return the current setpoint in A.

    `law`, `state` and `trace` are the bytes of their records.
    """
    return _step(
        law.view(_LAW)[0],
        tables,
        state.view(_STATE)[0],
        window,
        trace.view(TRACE)[0],
        displacement,
        bridged_samples,
    )


@compiled
def run(law, tables, state, window, traces, displacements):
    """Fill `traces` with one step for each displacement; arguments as for `step`."""
    law_record, state_record, trace_records = law.view(_LAW)[0], state.view(_STATE)[0], traces.view(TRACE)
    for index in range(len(displacements)):
        _step(law_record, tables, state_record, window, trace_records[index], displacements[index], 0)


@compiled
def _step(law, tables, state, window, trace, displacement, bridged_samples):
    if not abs(displacement) <= FARTHEST_DISPLACEMENT:  # also NaN
        return _refuse(trace, displacement)
    if not math.isfinite(_sum_of_memory(state)):
        return _clear(law, state, window, trace, displacement)
    rise = (displacement - state.displacement) / (bridged_samples + 1)
    for _ in range(bridged_samples):
        _advance(law, tables, state, window, trace, state.displacement + rise)
    trace.bridged_samples = bridged_samples
    current = _advance(law, tables, state, window, trace, displacement)
    if not math.isfinite(_sum_of_memory(state) + trace.predicted_velocity + trace.desired_force + current):
        return _clear(law, state, window, trace, displacement)
    return current


@compiled
def _sum_of_memory(state):
    """Return a sum that is a finite number only where all numbers of the memory are."""
    band, magnitude = state.band, state.switching.magnitude
    filters = band.z1 + band.z2 + band.displacement + band.earlier + state.displacement
    answer = state.normal_force + state.current + state.distance
    return filters + magnitude + state.deflection + answer


@compiled
def _clear(law, state, window, trace, displacement):
    """Begin afresh with a memory that was spoiled: whatever has done it, no current is made of it."""
    _rest(law, state, window, displacement)
    state.faults += 1
    return _refuse(trace, displacement)


@compiled
def _refuse(trace, displacement):
    trace.displacement = displacement
    trace.velocity = np.nan
    trace.band_displacement = np.nan
    trace.band_velocity = np.nan
    trace.predicted_velocity = np.nan
    trace.magnitude = np.nan
    trace.damping_active = 0
    trace.desired_force = 0.0
    trace.friction_deflection = np.nan
    trace.friction_coefficient = np.nan
    trace.normal_force = 0.0
    trace.current = 0.0
    trace.bridged_samples = 0
    return 0.0


@compiled
def _advance(law, tables, state, window, trace, displacement):
    trace.displacement = displacement
    trace.velocity = (displacement - state.displacement) / law.band.sample_time
    state.displacement = displacement

    banded, velocity, predicted = band_pass.step(law.band, state.band, displacement)
    magnitude, active = switching.step(law.switching, state.switching, window, banded)

    desired, coefficient, current = 0.0, np.nan, 0.0
    if active == 1:
        desired = damper_force(tables.damper, law.damper_step, predicted)
        force, coefficient = _normal_force(law, tables, state, desired, predicted)
        current = _faded(law, state, force_to_current.current_for(tables.current, law.limits, force))
    else:
        force = 0.0
        state.fading = 0
    state.current = current
    _, state.deflection, _ = simplified_step(
        law.contact, law.friction, state.deflection, predicted, force, law.band.sample_time
    )
    state.normal_force = force

    trace.band_displacement = banded
    trace.band_velocity = velocity
    trace.predicted_velocity = predicted
    trace.magnitude = magnitude
    trace.damping_active = active
    trace.desired_force = desired
    trace.friction_deflection = state.deflection
    trace.friction_coefficient = coefficient
    trace.normal_force = force
    trace.current = current
    return current


@compiled
def _faded(law, state, wanted):
    """Return the current (A) instead of the `wanted` one, beside it for a while after a change of the law."""
    if state.fading == 0:
        return wanted
    if state.fading == FADE_SAMPLES:
        state.distance = state.current - wanted
    current = wanted + state.distance * state.fading / FADE_SAMPLES
    state.fading -= 1
    return min(max(current, law.limits.offset_current), law.limits.highest_current)


@compiled
def _normal_force(law, tables, state, desired, velocity):
    """Return (normal force N, friction coefficient) that make the wanted force, within the table."""
    direction = -1.0 if velocity < 0.0 else 1.0
    force, coefficient = normal_force_for(
        law.friction, desired, velocity, direction * state.deflection, state.normal_force
    )
    return min(force, force_to_current.highest_force(tables.current)), coefficient
