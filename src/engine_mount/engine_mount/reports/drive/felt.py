"""What chassis and people feel of a drive by frequency, and what that costs; of the mounts beside it too."""

import math
from typing import Any

import numpy as np

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.reports.drive.beside import Beside, BesideError, name_of
from engine_mount.reports.sections.periodic import evenly, rms_in_bands, vertical_weighting
from engine_mount.settings.chosen import Parameters
from mount_models.quantity import with_flattened
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
_WEIGHTED = (0.4, 100.0)  # Hz: ISO 2631-1
_FADED = 0.25  # s, chosen: at both ends, else a jump from the end to the begin adds to all bands


def felt_beside(
    recording: Recording, parameters: Parameters, beside: Beside | str
) -> dict[str, dict[str, float]]:
    """Return {name: `FIGURES`} of a drive's own mount and of those beside it, while it is excited.

    NaN is unknown: bands above half the sample rate, wear on a road without a speed. Raises
    `BesideError` where `beside` is the reason why nothing stands there, and for too short a recording.
    """
    if isinstance(beside, str):
        raise BesideError(beside)
    sim = with_flattened(SimParameters(), parameters['mount_sim'])
    rate, kept = recorded_sample_rate(recording), beside.stamps >= beside.begin
    if np.count_nonzero(kept) < 2.0 * _FADED * rate:
        raise BesideError('hardly anything of the excitation was recorded')

    def felt(truth: Any, wear: float, heat: float) -> dict[str, float]:
        shaken, moved = (
            evenly(beside.stamps[kept] / 1e9, truth[name][kept], rate)[1]
            for name in ('chassis_acceleration', 'displacement')
        )
        to_end = np.arange(0.5, len(shaken)) / (_FADED * rate)
        shaken = shaken * np.sin(0.5 * np.pi * np.minimum(1.0, np.minimum(to_end, to_end[::-1])))
        bands = zip(rms_in_bands(shaken, BANDS, rate), BANDS, strict=True)
        figures = (
            *(each if high <= 0.5 * rate else math.nan for each, (_, high) in bands),
            *rms_in_bands(shaken, [_WEIGHTED], rate, vertical_weighting),
            float(np.std(moved)),
        )
        return dict(zip(FIGURES, (*figures, wear, heat), strict=True))

    truth = recording[SIM_TRUTH.name]
    places = np.unique(truth.stamps, return_index=True)[1][: len(kept)]
    own = {name: np.asarray(truth[name], np.float64)[places] for name in truth.columns}
    power = np.abs(own['friction_force'] * own['velocity'])[kept]
    per_km = 1e3 / sim.motorway.speed if sim.scenario == 'motorway' else math.nan  # no other names a speed
    heat = sim.coil.resistance * float(np.mean(np.square(own['coil_current'][kept])))
    found = {name_of(seat_of(parameters)): felt(own, per_km * float(np.mean(power)), heat)}
    return found | {name: felt(truth, 0.0, 0.0) for name, truth in beside.truths.items()}


def value_text(figure: str, value: float | None) -> str:
    """Return the value of one of `FIGURES` (SI, None or NaN: unknown) in its unit for people."""
    if value is None or math.isnan(value):
        return 'not measured'
    return f'{value * (1e3 if "(mm" in FIGURES[figure] else 1.0):.3g}'
