"""One drive of a mount over a measured road at one speed, and its figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.recorded_drive.evaluation import rms_in_bands
from engine_mount.experiments.sensitivity.grid import TruthOnly
from mount_models.sampling import SAMPLE_TIME

BANDS = ((0.9, 5.0), (5.0, 12.0), (12.0, 30.0), (30.0, 100.0))
"""Hz, chosen: the car's body, the engine on its mounts, above, and what is heard as rumbling."""
_FIELDS = ('displacement', 'velocity', 'friction_force', 'chassis_acceleration')
_SETTLING = 1.0  # s: a road fades in for so long


@dataclass(frozen=True)
class RoadJob:
    """One drive: its key (speed in km/h, mount) and the parameters of the nodes."""

    key: tuple[float, str]
    parameters: Mapping[str, Mapping[str, Any]]


def run_road_job(job: RoadJob) -> tuple[tuple[float, str], dict[str, Any]]:
    """Drive through the same closed loop as every drive in core; return key and figures."""
    truth = TruthOnly(_FIELDS)
    outcome = run_core_into(truth, job.parameters)
    signals = dict(zip(_FIELDS, truth.signals(outcome.excitation_start), strict=True))
    moved = {name: values[round(_SETTLING / SAMPLE_TIME) :] for name, values in signals.items()}
    acceleration = moved['chassis_acceleration'] - moved['chassis_acceleration'].mean()
    return job.key, {
        'seconds': moved['displacement'].size * SAMPLE_TIME,
        'displacement_rms_m': float(np.sqrt(np.mean(moved['displacement'] ** 2))),
        'displacement_peak_m': float(np.abs(moved['displacement']).max()),
        'acceleration_band_rms_m_s2': rms_in_bands(acceleration, BANDS),
        'friction_power_w': float(np.mean(np.abs(moved['friction_force'] * moved['velocity']))),
    }
