"""Other mounts on the road of a recorded drive: the original hydromount, and this one without current.

Simulated without electronics, bus and control, which have no say in it.
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
from mount_sim.plant.mounts import seat_of, seated_mount
from mount_sim.plant.plant import Plant, PlantSimulation

MOUNTS = {'hydromount': 'hydro', 'no current': 'friction'}
"""{name: mount in the seat, at 0 A} of what stands beside every drive."""
THIS = 'this mount'
_OWN = {'hydro': 'hydromount', 'friction_off': 'no current', 'elastomer': 'no current'}
LONGEST = 300.0  # s of a run, chosen: 3 s of computing
EXCITED = ('road_height', 'chassis_acceleration')  # of sim/truth; the first that is not 0 throughout
_KEPT = ('displacement', *EXCITED, 'velocity', 'mount_force', 'friction_force', 'coil_current')
_QUIET = np.zeros(5)  # no noise of the sensors

Array = NDArray[np.float64]


class BesideError(ValueError):
    """The other mounts cannot be computed; the text says why."""


class Beside(NamedTuple):
    """{name: truth} of the other mounts at the recorded stamps (ns) within the run.

    A truth has the columns `_KEPT` of sim/truth (SI). `begin` (ns): where the excitation begins.
    `road` (n,): the first of `EXCITED` that moves.
    """

    stamps: NDArray[np.int64]
    truths: dict[str, NDArray[np.void]]
    begin: int
    road: Array


class _Simulated(NamedTuple):
    """The truth of each mount (mounts, n) at all samples of a run; the one at which the excitation begins."""

    truths: NDArray[np.void]
    start: int
    sample_time: int  # ns


def simulations_beside(plant: Plant, seat: Seat, step_time: float) -> dict[str, PlantSimulation]:
    """Return {name: simulation} of `MOUNTS`, each in the seat of `plant`, to be advanced at 0 A."""
    plants = {name: plant._replace(mount=seated_mount(mount)) for name, mount in MOUNTS.items()}
    return {name: PlantSimulation(each, seat, step_time) for name, each in plants.items()}


def name_of(mount: str) -> str:
    """Return the name of a drive's own mount: that of `MOUNTS` where it is one of them."""
    return _OWN.get(mount, THIS)


def peaks_text(peaks: Mapping[str, float]) -> str:
    """Return the largest displacements (m) of mounts, as in `1.30 mm; hydromount 1.74 mm`."""
    return '; '.join(f'{name} {1e3 * peak:.2f} mm'.removeprefix(f'{THIS} ') for name, peak in peaks.items())


def mounts_beside(recording: Recording, parameters: Parameters) -> Beside:
    """Return what the other `MOUNTS` do on the excitation of a simulated drive, or raise `BesideError`.

    `parameters` are those of the drive's nodes. The place of the recording in the run is found by its
    excitation, to the bit: so it may be a part of the drive, and of another excitation nothing is told.
    """
    stamps, excited = _recorded(recording)
    if 'mount_sim' not in parameters:
        raise BesideError('the session names no parameters of mount_sim')
    if mounts_of(parameters):
        raise BesideError('for a car with several mounts it is not computed')
    # faults and the mount in the seat have no part in what shakes and carries the mount
    own = {name: value for name, value in parameters['mount_sim'].items() if name not in ('faults', 'mount')}
    try:
        simulated = _simulated(json.dumps(own, sort_keys=True, default=str))
    except BesideError:
        raise
    except (ValueError, TypeError, OSError) as error:
        raise BesideError(f'the run cannot be computed again: {error}') from None
    first = _first_sample(stamps, excited, simulated)
    places = first + _samples(stamps, simulated.sample_time)
    within = places < simulated.truths.shape[1]  # electronics in real time go on behind the end of the run
    truths = dict(zip(MOUNTS, simulated.truths[:, places[within]], strict=True))
    road = next(truths['hydromount'][name] for name in EXCITED if excited[name].any())
    truths.pop(name_of(seat_of(parameters)), None)
    begin = int(stamps[0]) + (simulated.start - first) * simulated.sample_time
    return Beside(stamps[within], truths, begin, road)


def _recorded(recording: Recording) -> tuple[NDArray[np.int64], dict[str, Array]]:
    try:
        truth = recording[SIM_TRUTH.name]
        stamps, order = np.unique(truth.stamps, return_index=True)
        if len(stamps):
            return stamps, {name: np.asarray(truth[name], np.float64)[order] for name in EXCITED}
    except (ReadingError, SeriesError):
        pass
    raise BesideError('no simulator recorded the excitation')


@functools.lru_cache(maxsize=2)
def _simulated(values: str) -> _Simulated:
    """Return the run of mount_sim's parameters (JSON); kept, for figures, picture and page share it."""
    sim = with_flattened(SimParameters(), json.loads(values))
    excitation = build_excitation(sim)
    if excitation.seat is Seat.BENCH:
        raise BesideError('a rack imposes the displacement, so nothing is isolated')
    shaking = Shaking(excitation, sim.sample_rate)
    if shaking.samples > LONGEST * sim.sample_rate:
        raise BesideError(f'it is computed for runs of up to {LONGEST:g} s')
    simulations = simulations_beside(sim.plant, excitation.seat, excitation.step_time).values()
    found = np.empty((len(MOUNTS), shaking.samples), [(name, float) for name in _KEPT])
    for block in range(0, shaking.samples, LONG_BLOCK):
        values_ahead, forces = shaking.ahead(block, min(LONG_BLOCK, shaking.samples - block))
        for place in range(len(values_ahead)):
            for mount, simulation in enumerate(simulations):
                simulation.read(_QUIET)
                found[mount, block + place] = tuple(simulation.truth[name] for name in _KEPT)
                simulation.advance(values_ahead[place], forces[place], 0.0)
    if not np.isfinite(found.view(float)).all():
        raise BesideError('the simulated plant has diverged')
    return _Simulated(found, shaking.start, sample_time_ns(sim.sample_rate))


def _samples(stamps: NDArray[np.int64], sample_time: int) -> NDArray[np.int64]:
    """Return the number of each sample, from the first recorded one on."""
    return np.asarray(np.round((stamps - stamps[0]) / sample_time), np.int64)


def _first_sample(stamps: NDArray[np.int64], excited: Mapping[str, Array], simulated: _Simulated) -> int:
    """Return which sample of the run the recording begins with."""
    name = next((name for name in EXCITED if excited[name].any()), None)
    if name is None:
        raise BesideError('the recording holds no excitation')
    # an acceleration that shakes the mount is the same in all
    recorded, ours = excited[name], simulated.truths[0][name]
    places = _samples(stamps, simulated.sample_time)
    clearest = np.argmax(np.abs(recorded))
    for candidate in (np.flatnonzero(ours == recorded[clearest]) - places[clearest]).tolist():
        within = candidate + places < len(ours)
        whole = candidate >= 0 and 2 * np.count_nonzero(within) > len(places)
        if whole and np.array_equal(ours[candidate + places[within]], recorded[within]):
            return candidate
    raise BesideError('the excitation that was recorded is not that of the session')
