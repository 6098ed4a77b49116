"""The friction that no policy can beat: the best force of the pads where road and engine are known ahead.

Without friction the car of the simulation is linear. One of its steps, taken apart by unit vectors, leads
from a row of state, friction, road and engine force to the next state. Of the friction

    p' = p + k (g - p) / sqrt(1 + (k (g - p) / s)^2),  f' = p' (f + c v) / (p' + c |v|)

p is the force that the pads can hold: it follows the level g with the current loop, and not faster than the
voltage of the coil allows (s for each step). The force f of the contact's spring c opposes the velocity v and
never exceeds p. The level g at 1 kHz, within 0 .. `LARGEST_FORCE`, is sought that makes

    J = w X / X_0 + (1 - w) A / A_0

small. X: mean square of the displacement, A: of the chassis acceleration, each in its band; X_0, A_0: without
current. The gradient comes from the adjoint of the steps. J has several minima, so another force may still be
better. The force is then made by currents in the simulation with all its laws, and that counts.
"""

import copy
import functools
from typing import Any

import numpy as np

from engine_mount.experiments.harness.closed_loop import at_each_step
from engine_mount.experiments.harness.experiment import Values
from engine_mount.experiments.harness.measures import BELOW_ISOLATION
from engine_mount.reports.drive.signals import FloatArray, Truth
from engine_mount.reports.sections.periodic import Band
from engine_mount.signals.excitation import build_excitation
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import speed_logarithm
from mount_models.friction.simplified import normal_force_for
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SAMPLE_TIME
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.closing import closed_state
from mount_sim.plant.vehicle import (
    VEHICLE_STATE,
    Vehicle,
    resting_vehicle,
    ride_without_friction,
    vehicle_step,
)

ACOUSTIC = (20.0, 200.0)
"""Hz: what the chassis passes on."""
LARGEST_FORCE = 300.0
"""N: what the magnet presses at its highest current."""
DAMPINGS = (250.0, 500.0, 1000.0, 2000.0, 3000.0)
"""N s/m, chosen: ideal viscous dampers beside the optimum."""
LATE = 2
"""Samples, chosen: about the delay of the loop, 1.9 ms."""
HORIZON = 60
"""Samples, chosen: half a period of the engine on its mounts."""
_SLEW = 40.0  # N/ms, chosen: 0.3 A/ms by the voltage of the coil, 150 N/A, coefficient 0.9
_STEPS = round(SAMPLE_TIME / STEP_TIME)
_DISPLACEMENT, _VELOCITY, *_CHASSIS = map(
    VEHICLE_STATE.names.index, ('engine_height', 'engine_velocity', 'chassis_height', 'chassis_velocity')
)
_ACCELERATION, _FRICTION, _ROAD, _ENGINE = range(len(VEHICLE_STATE.names), len(VEHICLE_STATE.names) + 4)
_SMALL = 1e-9  # N: keeps 0 / 0 away
_SLOWEST = 0.001  # m/s, chosen: friction of slower pads is spring, not law
MEASURES = ('displacement', 'acceleration')
_BANDS = (BELOW_ISOLATION, ACOUSTIC)
_ORDER = 4  # of the band-passes, chosen
_FIRST = 3000.0  # N s/m, chosen: the force of this ideal damper is improved
_ITERATIONS = 150, 40, 40  # chosen; few at a time, so that the linear car stays near the simulation
_ITERATIONS_AHEAD = 8  # chosen
_CURRENTS = np.linspace(HIGHEST_CURRENT, 0.1, 1000)  # A, chosen: while they fall the pads stay closed


def linear_car(vehicle: Vehicle) -> FloatArray:
    """Return what each number of a row adds to the next state, (row, state).

    Displacement and velocity of the mount stand for those of the engine; the acceleration is the last.
    """
    mount = [_DISPLACEMENT, _VELOCITY]
    matrix = np.zeros((_ENGINE + 1, _FRICTION))
    for place, row in enumerate(np.eye(_ENGINE + 1)):
        state = resting_vehicle()
        heights = state.view(float)
        heights[:] = row[:_ACCELERATION]
        heights[mount] += heights[_CHASSIS]
        motion = vehicle_step(vehicle, state[0], row[_ROAD], row[_ENGINE], row[_FRICTION], STEP_TIME)
        matrix[place] = [*heights, motion.chassis_acceleration]
        matrix[place, mount] -= heights[_CHASSIS]
    return matrix


@compiled
def ride(matrix, law, levels, rows, pads):
    """Fill the states and frictions of `rows` (n + 1, row) and `pads` (n + 1, 2): p and f before each step.

    `levels` (samples,) in N; `law` are k, s and c of the module's formulas. Row and pads 0 are the start.
    """
    follow, slew, spring = law
    per_sample = (len(rows) - 1) // len(levels)
    after = np.zeros(_FRICTION)
    for k in range(len(rows) - 1):
        velocity, before = rows[k, _VELOCITY], pads[k, 0]
        free = follow * (levels[k // per_sample] - before)
        p = before + free / np.sqrt(1.0 + free * free / (slew * slew))
        f = p * (pads[k, 1] + spring * velocity) / (p + spring * abs(velocity) + _SMALL)
        pads[k + 1] = p, f
        rows[k, _FRICTION] = f
        after[:] = 0.0
        for number in range(_ENGINE + 1):
            for state in range(_FRICTION):
                after[state] += matrix[number, state] * rows[k, number]
        rows[k + 1, :_FRICTION] = after


@compiled
def gradient(transposed, law, levels, rows, pads, wanted):
    """Return the derivatives by the levels (samples,) from those by the states at the samples, `wanted`.

    `wanted` (samples, 2) of displacement (1/m) and acceleration (s^2/m); the rest as `ride` filled it.
    """
    follow, slew, spring = law
    per_sample = (len(rows) - 1) // len(levels)
    found = np.zeros(len(levels))
    after, now = np.zeros(_FRICTION), np.zeros(_ENGINE + 1)
    by_p, by_f = 0.0, 0.0
    for k in range(len(rows) - 2, -1, -1):
        sample = k // per_sample
        now[:] = 0.0
        for state in range(_FRICTION):
            for number in range(_ENGINE + 1):
                now[number] += transposed[state, number] * after[state]
        by_f += now[_FRICTION]
        velocity, before = rows[k, _VELOCITY], pads[k, 0]
        p, free = pads[k + 1, 0], follow * (levels[sample] - before) / slew
        top, bottom = pads[k, 1] + spring * velocity, p + spring * abs(velocity) + _SMALL
        direction = 1.0 if velocity > 0.0 else -1.0
        now[_VELOCITY] += by_f * p * spring * (bottom - direction * top) / (bottom * bottom)
        by_p += by_f * top * (bottom - p) / (bottom * bottom)
        by_f *= p / bottom
        share = follow / (1.0 + free * free) ** 1.5
        found[sample] += share * by_p
        by_p *= 1.0 - share
        if k % per_sample == 0:
            now[_DISPLACEMENT] += wanted[sample, 0]
            now[_ACCELERATION] += wanted[sample, 1]
        after[:] = now[:_FRICTION]
    return found


class Window:
    """A stretch of a drive whose road and engine are known; `levels` are g (samples,) in N."""

    def __init__(self, sim: SimParameters, weight: float, without: Values):
        """`without`: `mean_squares` without current."""
        excitation = build_excitation(sim)
        self.sim, self.matrix = sim, linear_car(sim.vehicle)
        self.transposed = np.ascontiguousarray(self.matrix.T)
        self.rows = np.zeros((len(excitation.values) + 1, _ENGINE + 1))
        self.rows[:-1, _ROAD] = excitation.values[:]
        if excitation.engine_forces is not None:
            self.rows[:-1, _ENGINE] = excitation.engine_forces[:]
        self.pads = np.zeros((len(self.rows), 2))
        self.samples = len(excitation.values) // _STEPS
        self.law = _reached(sim, STEP_TIME), _SLEW / _STEPS, sim.contact.contact_stiffness * STEP_TIME
        self.memories = [np.zeros((_ORDER, 2)) for _ in _BANDS]
        """What the filters of both bands hold of the time before."""
        self.shares = weight / without['displacement'], (1.0 - weight) / without['acceleration']
        self.beside = np.zeros((self.samples, 2))
        """What displacement and acceleration of the simulation have more than those here, at the samples."""

    def cost(self, levels: FloatArray) -> tuple[float, FloatArray]:
        """Return J and its gradient (1/N)."""
        ride(self.matrix, self.law, levels, self.rows, self.pads)
        total, wanted = 0.0, np.zeros((self.samples, 2))
        for what, states in enumerate((self.states + self.beside).T):
            share = self.shares[what] / self.samples
            inside, _ = passed(states, _BANDS[what], self.memories[what])
            total += share * float(inside @ inside)
            wanted[:, what] = 2.0 * share * passed(inside[::-1], _BANDS[what])[0][::-1]
        return total, gradient(self.transposed, self.law, levels, self.rows, self.pads, wanted)

    @property
    def states(self) -> FloatArray:
        """Displacement (m) and acceleration (m/s^2) at the samples, (samples, 2)."""
        return self.rows[:-1:_STEPS, [_DISPLACEMENT, _ACCELERATION]]

    def improved(self, levels: FloatArray, iterations: int) -> FloatArray:
        """Return levels with a lower J, found from these."""
        from scipy.optimize import minimize

        def scaled(shares: FloatArray) -> tuple[float, FloatArray]:
            total, found = self.cost(LARGEST_FORCE * shares)
            return total, LARGEST_FORCE * found

        found = minimize(
            scaled,
            levels / LARGEST_FORCE,
            jac=True,
            method='L-BFGS-B',
            bounds=[(0.0, 1.0)] * self.samples,
            options={'maxiter': iterations, 'maxcor': 20, 'ftol': 1e-6},
        )
        return LARGEST_FORCE * found.x

    def ahead(self, now: int, preview: int) -> 'Window':
        """Return the next `HORIZON` samples from `now` on; the road stands still behind `preview`."""
        part = slice(_STEPS * now, _STEPS * (now + HORIZON) + 1)
        window = copy.copy(self)
        window.rows, window.pads = self.rows[part].copy(), self.pads[part].copy()
        window.samples = (len(window.rows) - 1) // _STEPS
        window.beside = self.beside[now : now + HORIZON]
        road = window.rows[:, _ROAD]
        road[_STEPS * preview :] = road[min(_STEPS * preview, len(road) - 1)]
        return window

    def damped(self, damping: float) -> tuple[Values, FloatArray]:
        """Return `mean_squares` and displacement (m) at 1 kHz with an ideal viscous damper (N s/m)."""
        road, engine = self.rows[:-1, [_ROAD, _ENGINE]].T.copy()
        ridden = ride_without_friction(self.sim.vehicle, resting_vehicle(), road, engine, STEP_TIME, damping)
        displacement, acceleration = (each[_STEPS - 1 :: _STEPS] for each in ridden)
        return mean_squares(displacement, acceleration), displacement

    def setpoints(self) -> FloatArray:
        """Return the currents (A) at 1 kHz that bring the pads to their force at the end of each sample."""
        ends, sim = slice(_STEPS, None, _STEPS), self.sim
        normal_forces = []
        for velocity, force in zip(self.rows[ends, _VELOCITY], self.pads[ends, 0], strict=True):
            sliding = np.copysign(max(abs(velocity), _SLOWEST), velocity)
            of_speed = 1.0, speed_logarithm(sim.friction, sliding)
            normal_forces.append(normal_force_for(of_speed, sim.friction, force, sliding, 0.0, force)[0])
        gap, forces = sim.mechanics.contact_gap, np.zeros(_CURRENTS.size)
        for place, current in enumerate(_CURRENTS):
            gap, forces[place] = closed_state(sim.mechanics, sim.actuator, current, gap)
        pressing = forces > 0.0
        steady = np.interp(normal_forces, forces[pressing][::-1], _CURRENTS[pressing][::-1])
        ahead = (1.0 / _reached(sim, SAMPLE_TIME) - 1.0) * np.diff(steady, prepend=0.0)
        return np.clip(steady + ahead, 0.0, HIGHEST_CURRENT)


def _reached(sim: SimParameters, time: float) -> float:
    """Return the share of a step of the current that the loop has made after `time` (s)."""
    return -float(np.expm1(-2.0 * np.pi * sim.electronics.current_bandwidth * time))


@functools.cache
def _filter(band: Band) -> Any:
    """Return the Butterworth filter of a band (Hz), as second-order sections."""
    from scipy.signal import butter  # loads long

    return butter(_ORDER, band, 'bandpass', fs=SAMPLE_RATE, output='sos')


def passed(values: FloatArray, band: Band, memory: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Return what passes the filter of a band (Hz), and its memory, (order, 2), behind the values."""
    from scipy.signal import sosfilt

    found = sosfilt(_filter(band), values, zi=np.zeros((_ORDER, 2)) if memory is None else memory)
    return np.asarray(found[0]), np.asarray(found[1])


def mean_squares(displacement: FloatArray, acceleration: FloatArray) -> Values:
    """Return the mean squares in their bands, in m^2 and m^2/s^4."""
    both = zip((displacement, acceleration), _BANDS, strict=True)
    return dict(zip(MEASURES, (float(np.mean(passed(*each)[0] ** 2)) for each in both), strict=True))


def of_run(truth: Any, *_: Any) -> Values:
    """Return `mean_squares` and the wear (W) of a run, of its `Truth` or of columns of `sim/truth`."""
    columns = vars(truth) if isinstance(truth, Truth) else truth
    wear = float(np.mean(np.abs(columns['friction_force'] * columns['velocity'])))
    return mean_squares(columns['displacement'], columns['chassis_acceleration']) | {'wear_w': wear}


def of_ideal(truth: Truth, sim: SimParameters) -> Values:
    """Return `of_run` of the run without current, and {N s/m: the same with an ideal viscous damper}."""
    without = of_run(truth)
    own = Window(sim, 0.5, without)
    return without | {'ideal': {f'{damping:g}': own.damped(damping)[0] for damping in DAMPINGS}}


def foreseen(preview: int, truth: Truth, sim: SimParameters) -> Values:
    """Return `mean_squares` of the linear car where the road is known only `preview` samples ahead.

    Each level is the first of the best for the next `HORIZON` samples; state and engine are known.
    """
    window = Window(sim, 0.5, of_run(truth))
    levels = np.zeros(window.samples)
    for now in range(window.samples):
        coming = slice(now, now + HORIZON)
        levels[coming] = window.ahead(now, preview).improved(levels[coming], _ITERATIONS_AHEAD)
        steps = slice(_STEPS * now, _STEPS * (now + 1) + 1)
        ride(window.matrix, window.law, levels[now : now + 1], window.rows[steps], window.pads[steps])
        now_states = window.states[now : now + 1].T
        window.memories = [passed(*each)[1] for each in zip(now_states, _BANDS, window.memories, strict=True)]
    return mean_squares(*window.states.T)


def best(weight: float, truth: Truth, sim: SimParameters) -> Values:
    """Return `of_run` with the best currents that were found; `late` with these `LATE` samples later."""
    window = Window(sim, weight, of_run(truth))
    levels = np.minimum(_FIRST * np.abs(np.gradient(window.damped(_FIRST)[1], SAMPLE_TIME)), LARGEST_FORCE)
    found: list[tuple[float, FloatArray, Values]] = []
    for iterations in _ITERATIONS:
        levels = window.improved(levels, iterations)
        window.cost(levels)
        setpoints = np.insert(window.setpoints(), 0, 0.0)
        played = at_each_step(setpoints, sim)[::_STEPS]
        figures = of_run(played)
        cost = sum(share * figures[name] for share, name in zip(window.shares, MEASURES, strict=True))
        found.append((cost, setpoints, figures))
        window.beside = np.stack([played['displacement'], played['chassis_acceleration']], 1) - window.states
    _, setpoints, figures = min(found, key=lambda each: each[0])
    later = np.concatenate([np.zeros(LATE), setpoints[:-LATE]])
    return figures | {'late': of_run(at_each_step(later, sim)[::_STEPS])}
