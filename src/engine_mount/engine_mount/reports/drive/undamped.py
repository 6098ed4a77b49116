"""The same drive without current: what the undamped mount would have done on the same excitation.

As the mount friction_off does from the excitation on: its pads are free of the rod. Simulated without
electronics, bus and control, which have no say in it.
"""

import functools
import json
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.options import mounts_of
from engine_mount.signals.excitation import build_excitation
from mount_models.quantity import with_flattened
from mount_models.sampling import sample_time_ns
from mount_ros.topics import SIM_TRUTH
from mount_sim.excitation.excitation import LONG_BLOCK, Seat, Shaking
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seated_mount
from mount_sim.plant.plant import PlantSimulation

LONGEST = 300.0  # s of a run, chosen: 7 s of computing
EXCITED = ('road_height', 'chassis_acceleration')  # of sim/truth; the first that is not 0 throughout
_UNDAMPED = {
    'friction_off': 'its coil driver is open',
    'elastomer': 'nothing but the elastomer is in the mount',
}
_QUIET = np.zeros(5)  # no noise of the sensors

Array = NDArray[np.float64]


class UndampedError(ValueError):
    """The undamped run cannot be told; the text says why."""


class Undamped(NamedTuple):
    """The undamped mount at the recorded stamps (ns) within the run: m, and m/s^2 of the chassis.

    `begin` (ns) is the stamp at which the excitation begins.
    """

    stamps: NDArray[np.int64]
    displacement: Array
    chassis_acceleration: Array
    begin: int


class _Simulated(NamedTuple):
    """All of a run at its samples, and the sample at which the excitation begins."""

    displacement: Array
    road_height: Array
    chassis_acceleration: Array
    start: int
    sample_time: int  # ns


def undamped_of(recording: Recording, parameters: Parameters) -> Undamped:
    """Return what the undamped mount does on the excitation of a simulated drive, or raise `UndampedError`.

    `parameters` are those of the drive's nodes. The place of the recording in the run is found by its
    excitation, to the bit: so it may be a part of the drive, and of another excitation nothing is told.
    """
    stamps, excited = _recorded(recording)
    if 'mount_sim' not in parameters:
        raise UndampedError('the session names no parameters of mount_sim')
    values = parameters['mount_sim']
    if mounts_of(parameters):
        raise UndampedError('for a car with several mounts it is not computed')
    name = str(values.get('mount', SimParameters().mount))
    if reason := _UNDAMPED.get(name):
        raise UndampedError(f'this is the undamped run itself: {reason}')
    # faults and the mount in the seat have no part in what shakes and carries the mount
    own = {name: value for name, value in values.items() if name not in ('faults', 'mount')}
    try:
        simulated = _simulated(json.dumps(own, sort_keys=True, default=str))
    except UndampedError:
        raise
    except (ValueError, TypeError, OSError) as error:
        raise UndampedError(f'the run cannot be computed again: {error}') from None
    first = _first_sample(stamps, excited, simulated)
    places = first + _samples(stamps, simulated.sample_time)
    within = places < len(simulated.displacement)  # electronics in real time go on behind the end of the run
    places = places[within]
    return Undamped(
        stamps[within],
        simulated.displacement[places],
        simulated.chassis_acceleration[places],
        int(stamps[0]) + (simulated.start - first) * simulated.sample_time,
    )


def _recorded(recording: Recording) -> tuple[NDArray[np.int64], dict[str, Array]]:
    try:
        truth = recording[SIM_TRUTH.name]
        stamps, order = np.unique(truth.stamps, return_index=True)
        if len(stamps):
            return stamps, {name: np.asarray(truth[name], np.float64)[order] for name in EXCITED}
    except (ReadingError, SeriesError):
        pass
    raise UndampedError('no simulator recorded the excitation')


@functools.lru_cache(maxsize=2)
def _simulated(values: str) -> _Simulated:
    """Return the run of mount_sim's parameters (JSON); kept, for a picture and a page ask for the same."""
    sim = with_flattened(SimParameters(), json.loads(values))
    excitation = build_excitation(sim)
    if excitation.seat is Seat.BENCH:
        raise UndampedError('a rack imposes the displacement, so nothing is isolated')
    shaking = Shaking(excitation, sim.sample_rate)
    if shaking.samples > LONGEST * sim.sample_rate:
        raise UndampedError(f'it is computed for runs of up to {LONGEST:g} s')
    plant = sim.plant._replace(mount=seated_mount('friction'))
    simulation = PlantSimulation(plant, excitation.seat, excitation.step_time)
    found = np.empty((3, shaking.samples))
    for block in range(0, shaking.samples, LONG_BLOCK):
        values_ahead, forces = shaking.ahead(block, min(LONG_BLOCK, shaking.samples - block))
        for place in range(len(values_ahead)):
            simulation.read(_QUIET)
            truth = simulation.truth
            found[:, block + place] = truth.displacement, truth.road_height, truth.chassis_acceleration
            simulation.advance(values_ahead[place], forces[place], 0.0)
    if not np.isfinite(found).all():
        raise UndampedError('the simulated plant has diverged')
    return _Simulated(found[0], found[1], found[2], shaking.start, sample_time_ns(sim.sample_rate))


def _samples(stamps: NDArray[np.int64], sample_time: int) -> NDArray[np.int64]:
    """Return the number of each sample, from the first recorded one on."""
    return np.asarray(np.round((stamps - stamps[0]) / sample_time), np.int64)


def _first_sample(stamps: NDArray[np.int64], excited: Mapping[str, Array], simulated: _Simulated) -> int:
    """Return which sample of the run the recording begins with."""
    name = next((name for name in EXCITED if excited[name].any()), None)
    if name is None:
        raise UndampedError('the recording holds no excitation')
    recorded, ours, places = excited[name], getattr(simulated, name), _samples(stamps, simulated.sample_time)
    clearest = np.argmax(np.abs(recorded))
    for candidate in (np.flatnonzero(ours == recorded[clearest]) - places[clearest]).tolist():
        within = candidate + places < len(ours)
        whole = candidate >= 0 and 2 * np.count_nonzero(within) > len(places)
        if whole and np.array_equal(ours[candidate + places[within]], recorded[within]):
            return candidate
    raise UndampedError('the excitation that was recorded is not that of the session')
