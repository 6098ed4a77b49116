"""The excitation that comes of the parameters of a scenario, or of an array on disk.

The desk makes the file of recordings and roads. It is NPY, its array (n,) of records with
one field of float64, little-endian, `STEP_TIME` apart:
`chassis_acceleration` in m/s^2 upwards, its mean removed (scenario recorded), or `road_height` in m upwards
(scenario road). The name of the field says what the numbers are, so no other array is taken for one.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from mount_models.arithmetic.elementary import cosines, sines
from mount_models.arithmetic.series import StreamedSeries, series_of, series_over_time
from mount_models.arrays import FloatArray
from mount_models.quantity import ParameterError, nearest
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.road import Gap, RandomRoad, gap_in_road, random_road, sweep_road
from mount_sim.excitation.scenario import SCENARIO_NAMES, STEP_TIME, IdleForce, TipIn
from mount_sim.parameters import SimParameters

FIELDS = {Seat.ACCELERATED_CHASSIS: 'chassis_acceleration', Seat.VEHICLE: 'road_height'}
_BLOCK = 1 << 20
_REMEDY = (
    'the simulator takes excitations at its own step alone; engine-mount drive makes them of recordings '
    'and roads, and leaves them in given/ of a drive'
)


def write_excitation(file: Path, excitation: Excitation) -> Path:
    """Write what shakes the plant, without the force on the engine; return `file`."""
    count, field = len(excitation.values), FIELDS[excitation.seat]
    rows = np.lib.format.open_memmap(file, 'w+', np.dtype([(field, '<f8')]), (count,))
    for first in range(0, count, _BLOCK):
        rows[field][first : first + _BLOCK] = excitation.values[first : first + _BLOCK]
    rows.flush()
    return file


def read_excitation(file: str, seat: Seat) -> StreamedSeries:
    """Return the numbers (n,) in `file`, or raise `ParameterError`."""
    field, values = FIELDS[seat], np.empty(0)
    try:
        rows = np.load(file, mmap_mode='r')
    except (OSError, ValueError, EOFError) as error:
        raise ParameterError(f'the excitation {file} cannot be read as NPY ({error}): {_REMEDY}') from None
    if isinstance(rows, np.ndarray) and rows.ndim == 1 and rows.dtype == np.dtype([(field, '<f8')]):
        values = rows[field]
    if not values.size:
        raise ParameterError(
            f'the excitation {file} is no array of at least one {field}, each {1e6 * STEP_TIME:g} us: '
            + _REMEDY
        )
    finite = np.isfinite(values)
    if not finite.all():
        raise ParameterError(
            f'the excitation {file} is not finite at number {int(finite.argmin())}: make it again'
        )
    return series_of(values)


_DEFAULT_DURATION = 15.0  # s, chosen
_UNEVEN_ORDERS = (0.5, 1.0, 1.5, 2.5, 3.0)  # of the crank, which turns once in two of the first harmonic


def build_excitation(sim: SimParameters, made: tuple[str, StreamedSeries] | None = None) -> Excitation:
    """Return the excitation of the chosen scenario, or raise `ValueError` with what is wrong.

    `made` are name and numbers of a recording or road that the desk has brought to the step of the plant;
    without it they are read from the file that the scenario names.
    """
    if sim.scenario not in SCENARIO_NAMES:
        raise ParameterError(f'scenario {sim.scenario!r} is unknown; {nearest(sim.scenario, SCENARIO_NAMES)}')
    shaken = _of_array(sim, made) if sim.scenario in _ARRAYS else _SCENARIOS[sim.scenario](sim)
    idle, tip_in = sim.idle, sim.tip_in
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
    force = series_over_time(len(shaken.values), shaken.step_time, partial(_engine_force, idle, tip_in))
    return replace(shaken, engine_forces=force)


def _engine_force(idle: IdleForce, tip_in: TipIn, time: FloatArray) -> FloatArray:
    """Return the force (N) of the idling engine and of one that rises linearly and stays."""
    force = np.zeros_like(time)
    if idle.amplitude != 0.0:
        turns = idle.frequency * time
        force += idle.amplitude * (sines(turns) + idle.second_share * sines(2.0 * turns))
        if idle.uneven_share != 0.0:
            for order in _UNEVEN_ORDERS:
                force += idle.amplitude * idle.uneven_share * sines(0.5 * order * turns)
    if tip_in.force != 0.0:
        force += tip_in.force * np.clip((time - tip_in.time) / tip_in.rise, 0.0, 1.0)
    return force


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
    road = RandomRoad(roughness=motorway.roughness, speed=motorway.speed, seed=sim.seed)
    position = motorway.speed * gap_time
    gap = Gap(motorway.gap_depth, position, motorway.gap_length, motorway.speed)

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
    return _over_time(sim, Seat.VEHICLE, duration, partial(sweep_road, sweep=chosen))


def _over_time(
    sim: SimParameters, seat: Seat, duration: float, at: Callable[[FloatArray], FloatArray]
) -> Excitation:
    values = series_over_time(round(duration / STEP_TIME), STEP_TIME, at)
    return Excitation(seat, values, STEP_TIME, sim.timeline.start)


def _of_array(sim: SimParameters, made: tuple[str, StreamedSeries] | None) -> Excitation:
    seat, what, needed = _ARRAYS[sim.scenario]
    settings = getattr(sim, sim.scenario)
    if not settings.file:
        raise ParameterError(f'scenario {sim.scenario} needs {needed}')
    if made is None and settings != type(settings)(settings.file):
        raise ParameterError(
            f'column, time_column, topic and scale of recorded.file ({settings.file}) are for engine-mount '
            'drive, which makes the excitation of a recording: leave them out for the simulator'
        )
    name, values = made or (Path(settings.file).name, read_excitation(settings.file, seat))
    duration, available = sim.timeline.duration, len(values) * STEP_TIME
    if duration > available + 0.001:
        raise ParameterError(
            f'duration ({duration:g} s) is longer than the {what} {name} ({available:.3f} s); ask for '
            'at most that'
        )
    cut = values.cut(round(duration / STEP_TIME)) if duration else values
    return Excitation(seat, cut, STEP_TIME, sim.timeline.start)


_ARRAYS = {
    'recorded': (
        Seat.ACCELERATED_CHASSIS,
        'recording',
        'a file: CSV, NPY, JSON or MCAP (engine-mount drive --file, or recorded.file)',
    ),
    'road': (
        Seat.VEHICLE,
        'road',
        'a measured road: engine-mount drive --road PROFILE --speed 60/3.6, or road.file',
    ),
}
_SCENARIOS = {'motorway': _motorway, 'bench': _bench, 'sweep': _sweep}
