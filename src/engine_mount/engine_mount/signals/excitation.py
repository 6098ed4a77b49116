"""Recorded signals as excitation: the vertical acceleration of the chassis, the height of the road.

The simulator takes arrays at its own step alone (`mount_sim.excitation.building`); here they are made.
"""

from collections.abc import Mapping as Keys
from dataclasses import replace
from pathlib import Path
from typing import Any

from engine_mount.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.signals.judgement import SHAKEN
from engine_mount.signals.mapping import ColumnChoice, Mapping, TimeChoice
from engine_mount.signals.quantities import Quantity, by_name
from engine_mount.signals.resampling import resampled
from engine_mount.signals.selection import select
from engine_mount.signals.signal import check_size
from mount_models.arithmetic.series import StreamedSeries
from mount_models.arithmetic.sums import mean
from mount_models.quantity import flattened
from mount_sim.excitation import building
from mount_sim.excitation.building import write_excitation
from mount_sim.excitation.excitation import Excitation
from mount_sim.excitation.scenario import STEP_TIME, RecordedScenario, RoadScenario
from mount_sim.parameters import SimParameters

LOWEST_RATE = 50.0  # Hz, chosen: 2.5 times the 20 Hz below which the engine moves on its mounts
LONGEST_GAP = 0.125  # s: one period of the eigenfrequency cannot be interpolated
LOWEST_ROAD_RATE = 100.0  # Hz, chosen: a road is of use up to 40 Hz at least
LONGEST_ROAD_GAP = 0.02  # s, chosen: half a period of the wheel's own mode is interpolated, no more
LARGEST_HEIGHT = 1.0
"""m, chosen: no wheel runs over more without a hill, which has no place in an excitation."""
_HEIGHT = by_name(Quantity('height', 'length', 'height of a road'))
ARRAY = 'excitation.npy'
"""Name of the array that the simulator of a drive takes."""


def build_excitation(sim: SimParameters) -> Excitation:
    """Return the excitation of the chosen scenario, of recordings and roads too; raises `ValueError`."""
    if sim.scenario == 'recorded' and sim.recorded.file:
        signal = recorded_signal(sim.recorded)
        values = acceleration_at(signal, STEP_TIME)
    elif sim.scenario == 'road' and sim.road.file:
        mapping = Mapping({'height': ColumnChoice('0' if sim.road.file.endswith('.npy') else '1', scale=1.0)})
        height = select(sim.road.file, mapping, _HEIGHT).signals['height']
        signal = evenly_spaced(height, LONGEST_ROAD_GAP, LOWEST_ROAD_RATE)
        check_size(
            signal.name, signal.values, signal.period, LARGEST_HEIGHT, 'm',
            'the height of a road is meant in m, without hills: engine-mount drive --road makes it of a '
            'profile',
        )  # fmt: skip
        values = resampled(signal, STEP_TIME)
    else:
        return building.build_excitation(sim)
    notes = tuple(f'{signal.name}: {note}' for note in signal.notes)
    return replace(building.build_excitation(sim, (signal.name, values)), notes=notes)


def with_array(values: Keys[str, Any], excitation: Excitation, folder: Path) -> dict[str, Any]:
    """Return the parameters of mount_sim, which name an array in `folder` if the scenario needs one."""
    scenario = values.get('scenario')
    if scenario not in ('recorded', 'road'):
        return dict(values)
    folder.mkdir(parents=True, exist_ok=True)
    file = str(write_excitation(folder / ARRAY, excitation).absolute())
    plain = RecordedScenario(file) if scenario == 'recorded' else RoadScenario(file)
    return {**values, **flattened(plain, scenario)}


def recorded_signal(recorded: RecordedScenario) -> EvenSignal:
    """Return the chosen signal evenly spaced, in m/s^2; raises `SignalError`.

    Without a unit in its header `recorded.scale` leads to m/s^2, as everywhere (`select`).
    """
    column = f'{recorded.topic}.{recorded.column}' if recorded.topic else recorded.column
    column = column or ('0' if recorded.file.endswith('.npy') else '')
    choice = ColumnChoice(column, scale=recorded.scale)
    mapping = Mapping({'acceleration': choice}, time=TimeChoice(recorded.time_column))
    signal = select(recorded.file, mapping).signals['acceleration']
    return evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)


def acceleration_at(even: EvenSignal, step_time: float) -> StreamedSeries:
    """Return the acceleration (n,) in m/s^2 at steps of `step_time` (s), without its mean.

    Raises `SignalError`, with the sample, beyond `SHAKEN`.
    """
    values = even.values - mean(even.values)
    check_size(
        even.name, values, even.period, SHAKEN, 'm/s^2 without the mean',
        'a chassis is not shaken so (the limit is chosen): is its unit another one (--scale), the column no '
        'acceleration, or this sample a fault to cut or repair?',
    )  # fmt: skip
    return resampled(even._replace(values=values), step_time)
