"""A displacement of the mount on the grid of the controller, from one signal or from two."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.resampling import has_step, resampled
from engine_mount.signals.signal import SECOND, FloatArray, SignalError
from mount_models.sampling import sample_time_ns

DISPLACEMENT = 'displacement'
ENGINE, CHASSIS = 'engine_displacement', 'chassis_displacement'
LOWEST_RATE = 100.0  # Hz, chosen: five times the 20 Hz up to which an engine moves on its mounts
SHORTEST = 0.5  # s, chosen: four periods of the band


def displacement_on_grid(
    signals: Mapping[str, EvenSignal], sample_rate: float, notes: list[str]
) -> tuple[NDArray[np.int64], FloatArray]:
    """Return stamps (ns) of `sample_rate` (Hz) and the displacement on them, in the unit of the signals.

    `signals` are {`displacement`: signal} or those of engine and chassis, whose difference it is. Adds what
    was done to `notes`; raises `SignalError`.
    """
    step, step_ns = 1.0 / sample_rate, sample_time_ns(sample_rate)
    begin = max(even.begin for even in signals.values())
    end = min(even.begin + round(even.length * SECOND) for even in signals.values())
    count = round((end - begin) / step_ns) + 1
    if count * step < SHORTEST:
        spans = '; '.join(
            f'{even.name}: {even.begin / 1e9:.3f} .. {even.begin / 1e9 + even.length:.3f} s'
            for even in signals.values()
        )
        raise SignalError(f'no overlap of {SHORTEST:g} s or more: {spans}')
    columns = {
        name: resampled(even, step, (begin - even.begin) / SECOND, count)[:] for name, even in signals.items()
    }
    notes += [
        f'{even.name}: resampled from {even.rate:.4g} Hz to {rate_text(sample_rate)}, band-limited'
        for even in signals.values()
        if not has_step(even, step)
    ]
    stamps = np.arange(begin, begin + count * step_ns, step_ns, dtype=np.int64)
    if DISPLACEMENT in columns:
        return stamps, columns[DISPLACEMENT]
    return stamps, columns[ENGINE] - columns[CHASSIS]


def rate_text(sample_rate: float) -> str:
    """Return a sample rate (Hz) in words."""
    return f'{sample_rate / 1000.0:g} kHz'
