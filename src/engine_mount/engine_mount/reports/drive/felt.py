"""What chassis and people feel of a drive by frequency, and what that costs; of the mounts beside it too."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.reports.drive.beside import Beside, BesideError, name_of
from engine_mount.reports.sections.periodic import evenly, faded, rms_in_bands, vertical_weighting
from engine_mount.settings.chosen import Parameters
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_RATE
from mount_ros.topics import SIM_TRUTH
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import seat_of

BANDS = ((5.0, 12.0), (12.0, 20.0), (20.0, 60.0), (60.0, 200.0), (200.0, 400.0))
"""Hz, chosen: the engine on its mounts, the wheels, the chassis, and what is heard."""
FIGURES = {
    **{f'acceleration_{low:g}_{high:g}_hz_m_s2': f'{low:g} to {high:g} Hz (mm/s²)' for low, high in BANDS},
    'acceleration_weighted_m_s2': 'weighted, ISO 2631-1 (mm/s²)',
    'displacement_rms_m': 'displacement (mm)',
    'wear_j_per_km': 'wear of the pads (J/km)',
    'coil_w': 'heat of the coil (W)',
}
"""{figure in SI units: its name and unit for people}; rms of the acceleration of the chassis, and so on."""
ACCELERATIONS = [figure for figure in FIGURES if figure.startswith('acceleration')]
_OF_TRUTH = ('chassis_acceleration', 'displacement', 'friction_force', 'velocity', 'coil_current')
_WEIGHTED = (0.4, 100.0)  # Hz: ISO 2631-1
_SHORTEST = 1.0  # s of excitation, chosen: what is faded at both ends is half of it


def felt(truth: Mapping[str, Any], sim: SimParameters, rate: float = SAMPLE_RATE) -> dict[str, float]:
    """Return `FIGURES` of columns of `sim/truth`, at `rate` (Hz).

    NaN is unknown: bands above half the rate, and wear where the road has no speed.
    """
    shaken = faded(truth['chassis_acceleration'], rate)
    per_km = 1e3 / sim.motorway.speed if sim.scenario == 'motorway' else math.nan
    figures = (
        *rms_in_bands(shaken, BANDS, rate),
        *rms_in_bands(shaken, [_WEIGHTED], rate, vertical_weighting),
        float(np.std(truth['displacement'])),
        per_km * float(np.mean(np.abs(truth['friction_force'] * truth['velocity']))),
        sim.coil.resistance * float(np.mean(np.square(truth['coil_current']))),
    )
    return dict(zip(FIGURES, figures, strict=True))


def felt_beside(
    recording: Recording, parameters: Parameters, beside: Beside | str
) -> dict[str, dict[str, float]]:
    """Return {name: `FIGURES`} of a drive's own mount and of those beside it, while it is excited.

    Raises `BesideError` where `beside` is the reason why nothing stands there, and for too short a recording.
    """
    if isinstance(beside, str):
        raise BesideError(beside)
    sim = with_flattened(SimParameters(), parameters['mount_sim'])
    rate, kept = recorded_sample_rate(recording), beside.stamps >= beside.begin
    if np.count_nonzero(kept) < _SHORTEST * rate:
        raise BesideError(f'less than {_SHORTEST:g} s of excitation were recorded')
    truth, time = recording[SIM_TRUTH.name], beside.stamps[kept] / 1e9
    places = np.unique(truth.stamps, return_index=True)[1][: len(kept)]
    truths = {name_of(seat_of(parameters)): {of: truth[of][places] for of in _OF_TRUTH}, **beside.truths}
    return {
        name: felt({of: evenly(time, each[of][kept], rate)[1] for of in _OF_TRUTH}, sim, rate)
        for name, each in truths.items()
    }


def value_text(figure: str, value: float | None) -> str:
    """Return the value of one of `FIGURES` (SI, None or NaN: unknown) in its unit for people."""
    if value is None or math.isnan(value):
        return 'not measured'
    return f'{value * (1e3 if "(mm" in FIGURES[figure] else 1.0):.3g}'
