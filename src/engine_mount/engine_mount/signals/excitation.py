"""Recorded signals as excitation: the vertical acceleration of the chassis, the height of the road.

The simulator takes arrays at its own step alone (`mount_sim.excitation.array_file`); here they are made.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from engine_mount.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.signals.loading import load_signal
from engine_mount.signals.plausibility import check_size
from engine_mount.signals.resampling import resampled
from mount_models.arithmetic.averages import mean
from mount_models.arithmetic.series import StreamedSeries
from mount_models.quantity import flattened
from mount_sim.excitation import building
from mount_sim.excitation.array_file import write_excitation
from mount_sim.excitation.excitation import Excitation
from mount_sim.excitation.scenario import STEP_TIME, RecordedScenario, RoadScenario
from mount_sim.parameters import SimParameters

LOWEST_RATE = 50.0  # Hz, chosen: 2.5 times the 20 Hz below which the engine moves on its mounts
LONGEST_GAP = 0.125  # s: one period of the eigenfrequency cannot be interpolated
LARGEST_ACCELERATION = 50.0
"""m/s^2, chosen: five times gravity shakes no chassis but in a crash, and is soon reached by a wrong unit."""
LOWEST_ROAD_RATE = 100.0  # Hz, chosen: a road is of use up to 40 Hz at least
LONGEST_ROAD_GAP = 0.02  # s, chosen: half a period of the wheel's own mode is interpolated, no more
LARGEST_HEIGHT = 1.0
"""m, chosen: no wheel runs over more without a hill, which has no place in an excitation."""
ARRAY = 'excitation.npy'
"""Name of the array that the simulator of a drive takes."""


def build_excitation(sim: SimParameters) -> Excitation:
    """Return the excitation of the chosen scenario, of recordings and roads too; raises `ValueError`."""
    if sim.scenario == 'recorded' and sim.recorded.file:
        signal = recorded_signal(sim.recorded)
        values = acceleration_at(signal, sim.recorded.scale, STEP_TIME)
    elif sim.scenario == 'road' and sim.road.file:
        signal = measured_height(sim.road.file)
        values = height_at(signal, STEP_TIME)
    else:
        return building.build_excitation(sim)
    notes = tuple(f'{signal.name}: {note}' for note in signal.notes)
    return replace(building.build_excitation(sim, (signal.name, values)), notes=notes)


def with_array(values: Mapping[str, Any], excitation: Excitation, folder: Path) -> dict[str, Any]:
    """Return the parameters of mount_sim, which name an array in `folder` if the scenario needs one."""
    scenario = values.get('scenario')
    if scenario not in ('recorded', 'road'):
        return dict(values)
    folder.mkdir(parents=True, exist_ok=True)
    file = str(write_excitation(folder / ARRAY, excitation).absolute())
    plain = RecordedScenario(file) if scenario == 'recorded' else RoadScenario(file)
    return {**values, **flattened(plain, scenario)}


def recorded_signal(recorded: RecordedScenario) -> EvenSignal:
    """Return the chosen signal evenly spaced, in its own unit; raises `SignalError`."""
    signal = load_signal(
        Path(recorded.file),
        column=recorded.column,
        time_column=recorded.time_column,
        topic=recorded.topic,
    )
    return evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)


def acceleration_at(even: EvenSignal, scale: float, step_time: float) -> StreamedSeries:
    """Return the acceleration (n,) in m/s^2 at steps of `step_time` (s), without its mean.

    Raises `SignalError`, with the sample, beyond `LARGEST_ACCELERATION`.
    """
    values = even.values - mean(even.values)
    check_size(
        even.name, scale * values, even.period, LARGEST_ACCELERATION, 'm/s^2 without the mean',
        'a chassis is not shaken so (the limit is chosen): is its unit another one (--scale), the column no '
        'acceleration, or this sample a fault to cut or repair?',
    )  # fmt: skip
    plain = resampled(replace(even, values=values), step_time)
    return StreamedSeries(len(plain), lambda first, behind: scale * plain[first:behind])


def measured_height(file: str | Path) -> EvenSignal:
    """Return the height (m) in `file` over time (s), evenly spaced; raises `SignalError`."""
    signal = load_signal(Path(file), column='1' if str(file).endswith('.csv') else '')
    return evenly_spaced(signal, LONGEST_ROAD_GAP, LOWEST_ROAD_RATE)


def height_at(even: EvenSignal, step_time: float) -> StreamedSeries:
    """Return the heights (n,) in m at steps of `step_time` (s); raises `SignalError` where they are none."""
    check_size(
        even.name, even.values, even.period, LARGEST_HEIGHT, 'm',
        'the height of a road is meant in m, without hills: engine-mount drive --road makes it of a profile',
    )  # fmt: skip
    return resampled(even, step_time)
