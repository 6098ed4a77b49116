"""One run of the sweep, and its peaks and rms by band."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import DriveSignals, FloatArray
from engine_mount.reports.sections.sweep import peak_per_band, rms_per_band
from mount_models.sampling import SAMPLE_TIME

FRICTION, HYDRO, OFF, ALWAYS = 'friction', 'hydromount', 'friction, 0 A', 'friction, always on'
FRICTION_IDLE, HYDRO_IDLE = 'friction, engine idling', 'hydromount, engine idling'
FIRST_FREQUENCY, RATE = 1.0, 1.0  # Hz, Hz/s: Sec. 6
RESONANCE = (7.0, 10.0)  # Hz
DEFINED_PEAK = 1.25
"""A local maximum of the displacement over frequency is a resonance peak if it exceeds the switch-on level by
this factor (chosen); below it the switched mount cannot damp."""
Band = tuple[float, float]


@dataclass(frozen=True)
class SweepRun:
    """One run of the sweep: its signals, and the frequency (Hz) at each sample."""

    drive: DriveSignals
    frequency: FloatArray


def peak_in(frequency: FloatArray, displacement: FloatArray, band: Band) -> float | None:
    """Return the largest displacement (m) while the sweep passes a band (Hz), None where it does not."""
    within = (frequency >= band[0]) & (frequency < band[1])
    whole = frequency[-1] >= band[1] - 0.01
    return float(np.max(np.abs(displacement[within]))) if whole and within.any() else None


def rms_in(frequency: FloatArray, acceleration: FloatArray, band: Band) -> float | None:
    """Return the rms of the acceleration (m/s^2) while the sweep passes a band, None where it does not."""
    within = (frequency >= band[0]) & (frequency < band[1])
    whole = frequency[-1] >= band[1] - 0.01
    return float(np.sqrt(np.mean(acceleration[within] ** 2))) if whole and within.any() else None


def peak_and_rms(displacement: FloatArray, acceleration: FloatArray) -> dict[str, Any]:
    """Return the largest displacement (m) below the isolation bands and the rms (m/s^2) in each of them.

    Both (n,) at 1 kHz from the begin of the sweep.
    """
    frequency = FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(displacement.size)
    return {
        'peak_m': peak_in(frequency, displacement, BELOW_ISOLATION),
        'rms': [rms_in(frequency, acceleration, band) for band in ISOLATION_BANDS],
    }


def defined_peak(edges: list[float], peaks: list[float], level: float) -> Band | None:
    """Return (frequency in the middle of its band, height m) of the highest resonance peak, None for none."""
    inner = [
        (edges[k] + 0.5, peaks[k])
        for k in range(1, len(peaks) - 1)
        if peaks[k] > peaks[k - 1] and peaks[k] > peaks[k + 1] and peaks[k] > DEFINED_PEAK * level
    ]
    return max(inner, key=lambda found: found[1], default=None)


def figures_of(passed: SweepRun, level: float) -> dict[str, Any]:
    """Return peaks, rms and switching frequencies of one run; `level` (m) is that of switching on."""
    truth, frequency = passed.drive.truth, passed.frequency
    edges, peaks = peak_per_band(frequency, truth.displacement)
    _, rms = rms_per_band(frequency, truth.chassis_acceleration)
    changes = switching(passed.drive.seen)
    return {
        'band_edges_hz': [*edges.tolist(), float(edges[-1]) + 1.0],
        'peak_displacement_m': peaks.tolist(),
        'chassis_acceleration_rms': rms.tolist(),
        'resonance_peak_m': peak_in(frequency, truth.displacement, RESONANCE),
        'highest_peak_m': peak_in(frequency, truth.displacement, BELOW_ISOLATION),
        'defined_peak': defined_peak(edges.tolist(), peaks.tolist(), level),
        'isolation_rms': [rms_in(frequency, truth.chassis_acceleration, band) for band in ISOLATION_BANDS],
        'resonance_rms': rms_in(frequency, truth.chassis_acceleration, RESONANCE),
        'switched_on_hz': [FIRST_FREQUENCY + RATE * time for time in changes.on],
        'switched_off_hz': [FIRST_FREQUENCY + RATE * time for time in changes.off],
    }
