"""Scenarios of the simulated drive: what can be set, and the excitation that comes of it."""

from dataclasses import replace
from typing import Annotated, NamedTuple, Protocol

from engine_mount.recordings.signals.even_grid import EvenSignal
from mount_models.arithmetic.series import StreamedSeries
from mount_models.quantity import ParameterError, Quantity
from mount_sim.excitation import excitation
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.measured_road import height_at, measured_height
from mount_sim.excitation.recorded import acceleration_at, recorded_acceleration
from mount_sim.excitation.road import Gap, RandomRoad, Sweep

SCENARIO_NAMES = ('motorway', 'bench', 'sweep', 'recorded', 'road')
STEP_TIME = 5e-5  # s, chosen: step of the plant, 20 in each sample


class Timeline(NamedTuple):
    """When the excitation happens, in simulated time."""

    start: Annotated[
        float,
        Quantity('s', 'rest before the excitation, in which the mount is initialised', 0.0, 60.0, 'chosen'),
    ] = 5.0
    duration: Annotated[
        float,
        Quantity(
            's',
            'length of the excitation; 0: that of the recording or sweep, else 15 s',
            0.0,
            7200.0,
            'chosen',
        ),
    ] = 0.0


class BenchScenario(NamedTuple):
    """A test rack that moves the mount on a sine."""

    frequency: Annotated[float, Quantity('Hz', 'frequency of the sine', 0.1, 100.0, 'paper, section 6')] = 8.0
    amplitude: Annotated[float, Quantity('m', 'amplitude of the sine', 0.0, 0.010, 'chosen')] = 0.001


class MotorwayScenario(NamedTuple):
    """A car on a road with a gap in it."""

    speed: Annotated[float, Quantity('m/s', 'speed of the car', 5.0, 90.0, 'chosen: 119 km/h')] = 33.0
    roughness: Annotated[
        float, Quantity('m^3', 'ISO 8608 roughness G_d at 0.1 cycles/m', 0.0, 1e-3, 'chosen: a good class A')
    ] = 2e-6
    gap_depth: Annotated[float, Quantity('m', 'depth of the gap', 0.0, 0.1, 'chosen')] = 0.020
    gap_length: Annotated[
        float, Quantity('m', 'effective length of the gap, after the tyre', 0.1, 5.0, 'chosen')
    ] = 1.0
    gap_time: Annotated[
        float,
        Quantity('s', 'when the wheel meets the gap; 0: after a third of the drive', 0.0, 3600.0, 'chosen'),
    ] = 0.0


class SweepScenario(NamedTuple):
    """A rack under the front wheels: a sine of rising frequency, its velocity of constant amplitude."""

    velocity_amplitude: Annotated[
        float, Quantity('m/s', 'V0: largest vertical velocity of the road', 0.0, 1.0, 'chosen')
    ] = 0.12
    first_frequency: Annotated[
        float, Quantity('Hz', 'frequency at the beginning', 0.1, 100.0, 'paper, section 6')
    ] = 1.0
    last_frequency: Annotated[
        float, Quantity('Hz', 'frequency at the end', 0.1, 100.0, 'paper, section 6')
    ] = 50.0
    rate: Annotated[float, Quantity('Hz/s', 'rise of the frequency', 0.01, 10.0, 'paper, section 6')] = 1.0
    ramp_in: Annotated[
        float, Quantity('s', 'the height grows linearly from zero for so long', 0.0, 10.0, 'chosen')
    ] = 1.0


class IdleForce(NamedTuple):
    """Force of the idling engine on itself, a sine with its second harmonic; none on a bench."""

    amplitude: Annotated[
        float, Quantity('N', 'F_i: amplitude of the first harmonic; 0: no idle force', 0.0, 2000.0, 'chosen')
    ] = 0.0
    frequency: Annotated[
        float, Quantity('Hz', 'first harmonic: two for each turn of the crank', 5.0, 200.0, 'chosen')
    ] = 26.7
    second_share: Annotated[
        float, Quantity('1', 'amplitude of the second harmonic over that of the first', 0.0, 2.0, 'chosen')
    ] = 0.4


class TipIn(NamedTuple):
    """Force on the engine from a pedal pushed down: it rises once and stays; none on a bench."""

    force: Annotated[
        float, Quantity('N', 'force upwards on the engine; 0: no tip-in', -5000.0, 5000.0, 'chosen')
    ] = 0.0
    time: Annotated[float, Quantity('s', 'it begins so long after the excitation', 0.0, 3600.0, 'chosen')] = (
        1.0
    )
    rise: Annotated[float, Quantity('s', 'the force grows linearly for so long', 0.001, 10.0, 'chosen')] = (
        0.05
    )


AccelerationScale = Annotated[
    float, Quantity('1', 'factor to m/s^2 upwards; -1 for an axis that points down', -1e4, 1e4, 'chosen')
]


class RecordedScenario(NamedTuple):
    """A recorded vertical acceleration of the chassis, upwards."""

    file: Annotated[str, Quantity('path', 'recording: CSV, NPY, JSON, folder of NPY pairs, or MCAP')] = ''
    column: Annotated[
        str,
        Quantity('name', 'column (CSV, JSON), signal.number (NPY) or field of the message (MCAP)'),
    ] = ''
    time_column: Annotated[str, Quantity('name', 'column of the time in s (CSV, JSON)')] = ''
    topic: Annotated[str, Quantity('name', 'topic (MCAP); empty: the only one that fits')] = ''
    scale: AccelerationScale = 1.0


class RoadScenario(NamedTuple):
    """A measured road: its height under the wheel over time, upwards."""

    file: Annotated[
        str,
        Quantity(
            'path', 'height (m) over time (s), as engine-mount drive --road makes it of a profile: NPY, CSV'
        ),
    ] = ''


_DEFAULT_DURATION = 15.0  # s, chosen


class Scenarios(Protocol):
    """The parameters of all scenarios; one of them is chosen by its name."""

    @property
    def scenario(self) -> str: ...

    @property
    def seed(self) -> int: ...

    @property
    def timeline(self) -> Timeline: ...

    @property
    def bench(self) -> BenchScenario: ...

    @property
    def motorway(self) -> MotorwayScenario: ...

    @property
    def sweep(self) -> SweepScenario: ...

    @property
    def recorded(self) -> RecordedScenario: ...

    @property
    def road(self) -> RoadScenario: ...

    @property
    def idle(self) -> IdleForce: ...

    @property
    def tip_in(self) -> TipIn: ...


def build_excitation(scenarios: Scenarios) -> Excitation:
    """Return the excitation of the chosen scenario, or raise `ValueError` with what is wrong."""
    shaken, idle, tip_in = _scenario(scenarios), scenarios.idle, scenarios.tip_in
    given = {'idle.amplitude': idle.amplitude, 'tip_in.force': tip_in.force}
    acting = {name: size for name, size in given.items() if size != 0.0}
    if not acting:
        return shaken
    if shaken.seat is Seat.BENCH:
        name, size = next(iter(acting.items()))
        raise ParameterError(
            f'{name} ({size:g} N) has no effect in scenario {scenarios.scenario}, where a '
            'rack imposes the displacement; set it to 0 or choose another scenario'
        )
    count, step_time = len(shaken.values), shaken.step_time
    forces = None
    if idle.amplitude != 0.0:
        forces = excitation.idle_force(idle.amplitude, idle.frequency, idle.second_share, count, step_time)
    if tip_in.force != 0.0:
        pushed = excitation.tip_in_force(tip_in.force, tip_in.time, tip_in.rise, count, step_time)
        forces = pushed if forces is None else forces.plus(pushed)
    return replace(shaken, engine_forces=forces)


def recorded_signal(recorded: RecordedScenario) -> EvenSignal:
    """Return the signal evenly spaced, not yet scaled; raises `SignalError`."""
    return recorded_acceleration(
        recorded.file,
        column=recorded.column,
        time_column=recorded.time_column,
        topic=recorded.topic,
    )


def _scenario(scenarios: Scenarios) -> Excitation:
    if scenarios.scenario == 'bench':
        return _bench(scenarios)
    if scenarios.scenario == 'motorway':
        return _motorway(scenarios)
    if scenarios.scenario == 'sweep':
        return _sweep(scenarios)
    if scenarios.scenario == 'recorded':
        return _recorded(scenarios)
    if scenarios.scenario == 'road':
        return _road(scenarios)
    known = ', '.join(SCENARIO_NAMES)
    raise ParameterError(f'scenario {scenarios.scenario!r} is unknown; known are {known}')


def _bench(scenarios: Scenarios) -> Excitation:
    timeline, bench = scenarios.timeline, scenarios.bench
    duration = timeline.duration or _DEFAULT_DURATION
    return excitation.bench_sine(bench.frequency, bench.amplitude, duration, timeline.start, STEP_TIME)


def _motorway(scenarios: Scenarios) -> Excitation:
    timeline, motorway = scenarios.timeline, scenarios.motorway
    duration = timeline.duration or _DEFAULT_DURATION
    gap_time = motorway.gap_time or duration / 3.0
    if motorway.gap_depth > 0.0 and gap_time >= duration:
        raise ParameterError(
            f'motorway.gap_time ({gap_time:g} s) must lie before the end of the drive ({duration:g} s); '
            'make the drive longer, the gap earlier, or gap_depth 0'
        )
    road = RandomRoad(roughness=motorway.roughness, speed=motorway.speed, seed=scenarios.seed)
    gap = Gap(
        depth=motorway.gap_depth,
        position=motorway.speed * gap_time,
        length=motorway.gap_length,
        speed=motorway.speed,
    )
    return excitation.motorway(road, gap, duration, timeline.start, STEP_TIME)


def _sweep(scenarios: Scenarios) -> Excitation:
    timeline, chosen = scenarios.timeline, scenarios.sweep
    if not chosen.last_frequency > chosen.first_frequency:
        raise ParameterError(
            f'sweep.last_frequency ({chosen.last_frequency:g} Hz) must lie above sweep.first_frequency '
            f'({chosen.first_frequency:g} Hz)'
        )
    whole = (chosen.last_frequency - chosen.first_frequency) / chosen.rate
    duration = timeline.duration or whole
    if duration > whole + STEP_TIME:
        raise ParameterError(
            f'duration ({duration:g} s) is longer than the sweep from {chosen.first_frequency:g} to '
            f'{chosen.last_frequency:g} Hz ({whole:g} s); ask for at most that, or raise sweep.last_frequency'
        )
    road = Sweep(chosen.velocity_amplitude, chosen.first_frequency, chosen.rate, chosen.ramp_in)
    return excitation.sweep(road, duration, timeline.start, STEP_TIME)


def _recorded(scenarios: Scenarios) -> Excitation:
    timeline, recorded = scenarios.timeline, scenarios.recorded
    if not recorded.file:
        raise ParameterError(
            'scenario recorded needs a file: CSV, NPY, JSON or MCAP (recorded.file, or --file)'
        )
    signal = recorded_signal(recorded)
    values = acceleration_at(signal, recorded.scale, STEP_TIME)
    values = _cut(values, timeline.duration, f'the recording {signal.name}')
    notes = tuple(f'{signal.name}: {note}' for note in signal.notes)
    return Excitation(Seat.ACCELERATED_CHASSIS, values, STEP_TIME, timeline.start, notes=notes)


def _road(scenarios: Scenarios) -> Excitation:
    timeline, file = scenarios.timeline, scenarios.road.file
    if not file:
        raise ParameterError(
            'scenario road needs a measured road: engine-mount drive --road PROFILE --speed 60/3.6, or '
            'road.file'
        )
    signal = measured_height(file)
    values = _cut(height_at(signal, STEP_TIME), timeline.duration, f'the road {signal.name}')
    notes = tuple(f'{signal.name}: {note}' for note in signal.notes)
    return Excitation(Seat.VEHICLE, values, STEP_TIME, timeline.start, notes=notes)


def _cut(values: StreamedSeries, duration: float, what: str) -> StreamedSeries:
    """Return the first `duration` (s) of `values`, all of them for 0; raises where there are not so many."""
    available = len(values) * STEP_TIME
    if duration > available + 0.001:
        raise ParameterError(
            f'duration ({duration:g} s) is longer than {what} ({available:.3f} s); ask for at most that'
        )
    return values.cut(round(duration / STEP_TIME)) if duration else values
