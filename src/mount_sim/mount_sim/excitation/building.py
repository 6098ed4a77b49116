"""The excitation that comes of the parameters of a scenario."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.signals.even_grid import EvenSignal
from mount_models.arithmetic.elementary import cosines, sines
from mount_models.arithmetic.series import StreamedSeries, series_over_time
from mount_models.quantity import ParameterError, checked
from mount_sim.excitation.excitation import Excitation, Seat, idle_force
from mount_sim.excitation.recorded import (
    acceleration_at,
    height_at,
    measured_height,
    recorded_acceleration,
)
from mount_sim.excitation.road import Gap, RandomRoad, Sweep, gap_in_road, random_road, sweep_road
from mount_sim.excitation.scenario import STEP_TIME, RecordedScenario, TipIn
from mount_sim.parameters import SimParameters

FloatArray = NDArray[np.float64]

_DEFAULT_DURATION = 15.0  # s, chosen


def build_excitation(sim: SimParameters) -> Excitation:
    """Return the excitation of the chosen scenario, or raise `ValueError` with what is wrong."""
    if sim.scenario not in _SCENARIOS:
        raise ParameterError(f'scenario {sim.scenario!r} is unknown; known are {", ".join(_SCENARIOS)}')
    shaken, idle, tip_in = _SCENARIOS[sim.scenario](sim), sim.idle, sim.tip_in
    given = {'idle.amplitude': idle.amplitude, 'tip_in.force': tip_in.force}
    acting = {name: size for name, size in given.items() if size != 0.0}
    if not acting:
        return shaken
    if shaken.seat is Seat.BENCH:
        name, size = next(iter(acting.items()))
        raise ParameterError(
            f'{name} ({size:g} N) has no effect in scenario {sim.scenario}, where a '
            'rack imposes the displacement; set it to 0 or choose another scenario'
        )
    count, step_time = len(shaken.values), shaken.step_time
    forces = None
    if idle.amplitude != 0.0:
        forces = idle_force(idle.amplitude, idle.frequency, idle.second_share, count, step_time)
    if tip_in.force != 0.0:
        pushed = series_over_time(count, step_time, partial(_pushed, tip_in))
        forces = pushed if forces is None else forces.plus(pushed)
    return replace(shaken, engine_forces=forces)


def _pushed(tip_in: TipIn, time: FloatArray) -> FloatArray:
    """Return a force (N) that rises linearly and stays."""
    return np.asarray(tip_in.force * np.clip((time - tip_in.time) / tip_in.rise, 0.0, 1.0))


def recorded_signal(recorded: RecordedScenario) -> EvenSignal:
    """Return the signal evenly spaced, not yet scaled; raises `SignalError`."""
    return recorded_acceleration(
        recorded.file,
        column=recorded.column,
        time_column=recorded.time_column,
        topic=recorded.topic,
    )


def _bench(sim: SimParameters) -> Excitation:
    frequency, amplitude = sim.bench

    def displacement(time: FloatArray) -> FloatArray:
        fade = np.clip(time * frequency, 0.0, 1.0)  # over the first period
        # A half cosine has no corner at either end, so the fade adds no impact of its own.
        return np.asarray(amplitude * sines(frequency * time) * 0.5 * (1.0 - cosines(0.5 * fade)))

    return _over_time(sim, Seat.BENCH, sim.timeline.duration or _DEFAULT_DURATION, displacement)


def _motorway(sim: SimParameters) -> Excitation:
    motorway, duration = sim.motorway, sim.timeline.duration or _DEFAULT_DURATION
    gap_time = motorway.gap_time or duration / 3.0
    if motorway.gap_depth > 0.0 and gap_time >= duration:
        raise ParameterError(
            f'motorway.gap_time ({gap_time:g} s) must lie before the end of the drive ({duration:g} s); '
            'make the drive longer, the gap earlier, or gap_depth 0'
        )
    road = checked(RandomRoad(roughness=motorway.roughness, speed=motorway.speed, seed=sim.seed))
    position = motorway.speed * gap_time
    gap = checked(Gap(motorway.gap_depth, position, motorway.gap_length, motorway.speed))

    def height(time: FloatArray) -> FloatArray:
        rough = random_road(time, road) if road.roughness > 0.0 else np.zeros_like(time)
        return rough + gap_in_road(time, gap)

    return _over_time(sim, Seat.VEHICLE, duration, height)


def _sweep(sim: SimParameters) -> Excitation:
    chosen = sim.sweep
    if not chosen.last_frequency > chosen.first_frequency:
        raise ParameterError(
            f'sweep.last_frequency ({chosen.last_frequency:g} Hz) must lie above sweep.first_frequency '
            f'({chosen.first_frequency:g} Hz)'
        )
    whole = (chosen.last_frequency - chosen.first_frequency) / chosen.rate
    duration = sim.timeline.duration or whole
    if duration > whole + STEP_TIME:
        raise ParameterError(
            f'duration ({duration:g} s) is longer than the sweep from {chosen.first_frequency:g} to '
            f'{chosen.last_frequency:g} Hz ({whole:g} s); ask for at most that, or raise sweep.last_frequency'
        )
    road = Sweep(chosen.velocity_amplitude, chosen.first_frequency, chosen.rate, chosen.ramp_in)
    return _over_time(sim, Seat.VEHICLE, duration, partial(sweep_road, sweep=checked(road)))


def _over_time(
    sim: SimParameters, seat: Seat, duration: float, at: Callable[[FloatArray], FloatArray]
) -> Excitation:
    values = series_over_time(round(duration / STEP_TIME), STEP_TIME, at)
    return Excitation(seat, values, STEP_TIME, sim.timeline.start)


def _recorded(sim: SimParameters) -> Excitation:
    recorded = sim.recorded
    if not recorded.file:
        raise ParameterError(
            'scenario recorded needs a file: CSV, NPY, JSON or MCAP (recorded.file, or --file)'
        )
    signal = recorded_signal(recorded)
    values = acceleration_at(signal, recorded.scale, STEP_TIME)
    return _measured(sim, Seat.ACCELERATED_CHASSIS, signal, values, 'recording')


def _road(sim: SimParameters) -> Excitation:
    file = sim.road.file
    if not file:
        raise ParameterError(
            'scenario road needs a measured road: engine-mount drive --road PROFILE --speed 60/3.6, or '
            'road.file'
        )
    signal = measured_height(file)
    return _measured(sim, Seat.VEHICLE, signal, height_at(signal, STEP_TIME), 'road')


def _measured(
    sim: SimParameters, seat: Seat, signal: EvenSignal, values: StreamedSeries, what: str
) -> Excitation:
    duration, available = sim.timeline.duration, len(values) * STEP_TIME
    if duration > available + 0.001:
        raise ParameterError(
            f'duration ({duration:g} s) is longer than the {what} {signal.name} ({available:.3f} s); ask for '
            'at most that'
        )
    cut = values.cut(round(duration / STEP_TIME)) if duration else values
    notes = tuple(f'{signal.name}: {note}' for note in signal.notes)
    return Excitation(seat, cut, STEP_TIME, sim.timeline.start, notes=notes)


_SCENARIOS = {
    'motorway': _motorway,
    'bench': _bench,
    'sweep': _sweep,
    'recorded': _recorded,
    'road': _road,
}
