"""What a recording tells of the displacement, and of what control did to the friction."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.recordings.events import switching_places
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.times import Times, each_once, misdated
from mount_ros.topics import DISPLACEMENT

BANDS = (BELOW_ISOLATION, *ISOLATION_BANDS)
TRACE_COLUMNS = ('damping_active', 'velocity', 'friction_coefficient', 'normal_force')

_ORDER = 4  # of the band-pass, chosen: at each side of the band
_BLOCK = 1 << 13  # samples whose power is summed together, chosen


def displacement_figures(displacement: Series, rate: float) -> dict[str, Any]:
    """Return peak and rms, of the whole displacement and in bands, {} where none is known; `rate` in Hz.

    Samples count in the order of their stamps, of several with the same stamp the first. Those that are
    misdated are left out: between them and the others there is nothing to look at.
    """
    try:
        stamps, values = displacement.stamps, displacement[DISPLACEMENT.names[0]]
    except SeriesError:
        return {}
    wrong = misdated(stamps)
    if wrong.any():
        stamps, values = stamps[~wrong], values[~wrong]
    rising, places = each_once(stamps)
    values = values[places]
    known = values[np.isfinite(values)]
    if not known.size:
        return {}
    figures = {'peak_displacement_m': float(np.abs(known).max()), 'rms_displacement_m': float(np.std(known))}
    return figures | band_figures(rising, values, rate)


def band_figures(stamps: Times, values: NDArray[np.float64], rate: float) -> dict[str, float]:
    """Return peak and rms of displacements (m, (n,)) in `BANDS`, NaN where they are too short for one.

    The stamps (ns) rise. The signal is taken at even steps of `rate` (Hz), unknown and missing samples on a
    straight line between their neighbours, less its first value; it passes a causal Butterworth band-pass.
    """
    from scipy import signal  # takes 0.7 s to load

    known = np.isfinite(values)
    time, values = ((stamps - stamps[:1]) * 1e-9)[known], values[known]
    count = math.floor((time[-1] - time[0]) * rate + 0.5) + 1 if len(time) > 1 else 0
    moved = np.interp(time[0] + np.arange(count) / rate, time, values) - values[0] if count else values
    figures: dict[str, float] = {}
    for low, high in BANDS:
        peak = rms = math.nan
        if count >= rate / low:  # less than one period of its lowest frequency is too short
            sections = signal.butter(_ORDER, (low, high), 'bandpass', fs=rate, output='sos')
            passed = signal.sosfilt(sections, moved)
            peak, rms = float(np.abs(passed).max()), math.sqrt(float(np.mean(passed**2)))
        band = f'{low:g}_{high:g}_hz_m'
        figures |= {f'peak_{band}': peak, f'rms_{band}': rms}
    return figures


def trace_figures(trace: Series, sample_time: float) -> dict[str, Any]:
    """Return switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction.

    {} where the trace does not tell them; `sample_time` in s.
    """
    try:
        active, velocity, coefficient, force = (trace[name] for name in TRACE_COLUMNS)
    except SeriesError:
        return {}
    stamps = trace.stamps
    order = slice(None) if np.all(stamps[1:] >= stamps[:-1]) else np.argsort(stamps, kind='stable')
    on, _ = switching_places((stamps[order] - stamps[order][:1]) / 1e9, active[order])
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(active), _BLOCK)]
    power = [np.nan_to_num(np.abs(coefficient[at] * force[at] * velocity[at])).sum() for at in blocks]
    return {
        'switched_on': len(on),
        'damping_s': sample_time * np.count_nonzero(active > 0.0),
        'pad_energy_j': sample_time * math.fsum(power),
    }
