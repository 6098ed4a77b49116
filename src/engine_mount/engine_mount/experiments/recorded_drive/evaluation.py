"""What a recorded drive does to a mount: amplitude densities, rms in bands, friction mount against others."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_mount.experiments.harness.contract import ExperimentError
from engine_mount.reports.drive.signals import DriveSignals, FloatArray
from mount_models.sampling import SAMPLE_TIME

FRICTION, HYDRO, ELASTOMER = 'friction mount', 'hydromount', 'elastomer alone'
BANDS = ((1.0, 5.0), (5.0, 12.0), (12.0, 30.0))
"""Hz, chosen: the car's body, the engine on its mounts, above."""
_SEGMENT = 4.096  # s, chosen: a spectrum with lines 0.24 Hz apart, and many segments in a minute
SHORTEST = 3.0 * _SEGMENT
_FILTER_ORDER = 4  # chosen, of the band-pass that goes forth and back
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Spectra:
    """Amplitude densities over frequency (Hz): displacement (m/sqrt(Hz)), mount force (N/sqrt(Hz))."""

    frequency: FloatArray
    displacement: FloatArray
    force: FloatArray


def spectra_of(drive: DriveSignals) -> Spectra:
    """Return the amplitude densities of displacement and mount force (Welch, Hann window)."""
    frequency, displacement = _density(drive.truth.displacement)
    _, force = _density(drive.truth.mount_force)
    return Spectra(frequency, np.sqrt(displacement), np.sqrt(force))


def rms_in_bands(values: FloatArray, bands: Sequence[tuple[float, float]] = BANDS) -> list[float]:
    """Return the rms of what `values` (n,) at 1 kHz hold in each band (Hz), in their unit.

    From one spectrum of all of it: every moment counts the same, as it does not with windows.
    """
    amplitude = np.abs(np.fft.rfft(values)) / len(values)
    frequency = np.fft.rfftfreq(len(values), SAMPLE_TIME)
    inside = [(frequency >= low) & (frequency < high) for low, high in bands]
    return [float(np.sqrt(2.0 * np.sum(amplitude[band] ** 2))) for band in inside]


def rms_in_bands_within(values: FloatArray, within: BoolArray) -> list[float] | None:
    """Return the rms of `values` (n,) at 1 kHz in each of `BANDS` at the samples `within` (n,), None of none.

    By a band-pass without phase: what happens at one time stays there but for about a period of the lower
    edge. At both edges of the band a quarter of the power is left.
    """
    from scipy.signal import butter, sosfiltfilt  # here, for they take longer to load than all the rest

    if not within.any():
        return None
    found = []
    for band in BANDS:
        sections = butter(_FILTER_ORDER, band, 'bandpass', fs=1.0 / SAMPLE_TIME, output='sos')
        passed = sosfiltfilt(sections, values - np.mean(values))[within]
        found.append(float(np.sqrt(np.mean(passed**2))))
    return found


def near(active: BoolArray, margin: float) -> BoolArray:
    """Return where damping is `active` (n,) at 1 kHz, and `margin` (s) before and behind."""
    count = round(margin / SAMPLE_TIME)
    return np.convolve(active, np.ones(2 * count + 1), 'same') > 0.5


def _density(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    from scipy.signal import welch  # here, as above

    count = round(_SEGMENT / SAMPLE_TIME)
    if len(values) < round(SHORTEST / SAMPLE_TIME):
        raise ExperimentError(
            f'the recorded drive lasts {len(values) * SAMPLE_TIME:.1f} s; a spectrum needs at least '
            f'{SHORTEST:.1f} s: give a longer one'
        )
    frequency, density = welch(values, 1.0 / SAMPLE_TIME, 'hann', count, 3 * count // 4)  # evenly weighted
    return frequency, density


def ratios(figures: dict[str, Any], key: str, other: str = HYDRO) -> list[float]:
    """Return by band the friction mount's rms over that of `other`; nothing where there is no such rms."""
    mine, its = figures['runs'][FRICTION][key], figures['runs'][other][key]
    return [] if mine is None else [each / beside for each, beside in zip(mine, its, strict=True)]


def while_on(figures: dict[str, Any]) -> str:
    """Return a sentence on the rms displacement of all mounts while the friction damper was on."""
    key = 'displacement_rms_while_friction_is_on_m'
    values = {name: each[key] for name, each in figures['runs'].items()}
    if values[FRICTION] is None:
        return 'Damping was never on: the displacement did not stay above the switch-on level long enough.'
    told = ', '.join(f'{name} {1e3 * value:.2f} mm' for name, value in values.items())
    return f'In the seconds in which damping was on, the rms displacements are: {told}.'
