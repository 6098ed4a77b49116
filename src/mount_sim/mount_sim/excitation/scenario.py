"""Scenarios of the simulated drive: what can be set."""

from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity

SCENARIO_NAMES = ('motorway', 'bench', 'sweep', 'recorded', 'road')
STEP_TIME = 5e-5  # s, chosen: step of the plant, 20 in each sample


class Timeline(NamedTuple):
    """When the excitation happens, in simulated time."""

    start: Annotated[
        float,
        Quantity('s', 'rest before the excitation, in which the mount is initialised', 0.0, 60.0),
    ] = 5.0
    duration: Annotated[
        float,
        Quantity(
            's',
            'length of the excitation; 0: that of the recording or sweep, else 15 s',
            0.0,
            7200.0,
        ),
    ] = 0.0


class BenchScenario(NamedTuple):
    """A test rack that moves the mount on a sine."""

    frequency: Annotated[float, Quantity('Hz', 'frequency of the sine', 0.1, 100.0, 'paper, section 6')] = 8.0
    amplitude: Annotated[float, Quantity('m', 'amplitude of the sine', 0.0, 0.010)] = 0.001


class MotorwayScenario(NamedTuple):
    """A car on a road with a gap in it."""

    speed: Annotated[float, Quantity('m/s', 'speed of the car', 5.0, 90.0, 'chosen: 119 km/h')] = 33.0
    roughness: Annotated[
        float, Quantity('m^3', 'ISO 8608 roughness G_d at 0.1 cycles/m', 0.0, 1e-3, 'chosen: a good class A')
    ] = 2e-6
    gap_depth: Annotated[float, Quantity('m', 'depth of the gap', 0.0, 0.1)] = 0.020
    gap_length: Annotated[float, Quantity('m', 'effective length of the gap, after the tyre', 0.1, 5.0)] = 1.0
    gap_time: Annotated[
        float,
        Quantity('s', 'when the wheel meets the gap; 0: after a third of the drive', 0.0, 3600.0),
    ] = 0.0


class SweepScenario(NamedTuple):
    """A rack under the front wheels: a sine of rising frequency, its velocity of constant amplitude."""

    velocity_amplitude: Annotated[
        float, Quantity('m/s', 'V0: largest vertical velocity of the road', 0.0, 1.0)
    ] = 0.12
    first_frequency: Annotated[
        float, Quantity('Hz', 'frequency at the beginning', 0.1, 100.0, 'paper, section 6')
    ] = 1.0
    last_frequency: Annotated[
        float, Quantity('Hz', 'frequency at the end', 0.1, 100.0, 'paper, section 6')
    ] = 50.0
    rate: Annotated[float, Quantity('Hz/s', 'rise of the frequency', 0.01, 10.0, 'paper, section 6')] = 1.0
    ramp_in: Annotated[float, Quantity('s', 'the height grows linearly from zero for so long', 0.0, 10.0)] = (
        1.0
    )


class IdleForce(NamedTuple):
    """Force of the idling engine on itself, sines at orders of its crank; none on a bench."""

    amplitude: Annotated[
        float, Quantity('N', 'F_i: amplitude of the first harmonic; 0: no idle force', 0.0, 2000.0)
    ] = 0.0
    frequency: Annotated[
        float, Quantity('Hz', 'first harmonic: two for each turn of the crank', 5.0, 200.0)
    ] = 26.7
    second_share: Annotated[
        float, Quantity('1', 'amplitude of the second harmonic over that of the first', 0.0, 2.0)
    ] = 0.4
    uneven_share: Annotated[
        float,
        Quantity('1', 'amplitude at orders 0.5, 1, 1.5, 2.5, 3 of the crank, over the same', 0.0, 2.0),
    ] = 0.0
    speed_sent: Annotated[
        bool, Quantity('1', 'send the turns of the crank on the bus, and let mount_driver read them')
    ] = False


class TipIn(NamedTuple):
    """Force on the engine from a pedal pushed down: it rises once and stays; none on a bench."""

    force: Annotated[float, Quantity('N', 'force upwards on the engine; 0: no tip-in', -5000.0, 5000.0)] = 0.0
    time: Annotated[float, Quantity('s', 'it begins so long after the excitation', 0.0, 3600.0)] = 1.0
    rise: Annotated[float, Quantity('s', 'the force grows linearly for so long', 0.001, 10.0)] = 0.05


AccelerationScale = Annotated[
    float, Quantity('1', 'factor to m/s^2 upwards; -1 for an axis that points down', -1e4, 1e4)
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
