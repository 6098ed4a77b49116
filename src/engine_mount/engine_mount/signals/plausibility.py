"""What a recorded signal and its resampled form may look like."""

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.signal import FloatArray, SignalError

OVERSHOOT = 0.5
"""Share of the range of the samples, chosen: a sine of a quarter of the rate, met on its flanks, has 0.21."""
_ROUNDING = 1e-12


def check_range(even: EvenSignal, value: float, at: float, low: float, high: float) -> None:
    """Raise `SignalError` if the resampled `value` at `at` s leaves `low` .. `high` by more than `OVERSHOOT`.

    `low` and `high` are the least and the greatest of the samples.
    """
    margin = OVERSHOOT * (high - low) + _ROUNDING * max(abs(low), abs(high))
    if low - margin <= value <= high + margin:
        return
    raise SignalError(
        f'{even.name}: resampled it is {value:.4g} at {at:.4f} s, near sample '
        f'{round(at / even.period)}; its samples are {low:.4g} .. {high:.4g}, and it may leave that range by '
        f'{OVERSHOOT:g} of it: are samples there faulty? Cut or repair them'
    )


def check_size(name: str, values: FloatArray, step_time: float, limit: float, unit: str, remedy: str) -> None:
    """Raise `SignalError` with the largest of `values` (n,), `step_time` s apart, if beyond +- `limit`."""
    ends = (int(values.argmax()), int(values.argmin()))  # no absolute values: they would be an hour once more
    place = max(ends, key=lambda each: (abs(values[each]), -each))
    if abs(values[place]) <= limit:
        return
    raise SignalError(
        f'{name}: sample {place} at {place * step_time:.4f} s is {values[place]:.4g} {unit}, beyond '
        f'+-{limit:g} {unit} ({np.count_nonzero(np.abs(values) > limit)} such of {len(values)}); {remedy}'
    )
