"""Measured height of the road under the wheel as excitation."""

from pathlib import Path

from engine_mount.recordings.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.recordings.signals.loading import load_signal
from engine_mount.recordings.signals.plausibility import check_size
from engine_mount.recordings.signals.resampling import resampled
from mount_models.arithmetic.series import StreamedSeries

LOWEST_RATE = 100.0  # Hz, chosen: a road is of use up to 40 Hz at least
LONGEST_GAP = 0.02  # s, chosen: half a period of the wheel's own mode is interpolated, no more
LARGEST_HEIGHT = 1.0
"""m, chosen: no wheel runs over more without a hill, which has no place in an excitation."""


def measured_height(file: str | Path) -> EvenSignal:
    """Return the height (m) in `file` over time (s), evenly spaced; raises `SignalError`."""
    signal = load_signal(Path(file), column='1' if str(file).endswith('.csv') else '')
    return evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)


def height_at(even: EvenSignal, step_time: float) -> StreamedSeries:
    """Return the heights (n,) in m at steps of `step_time` (s); raises `SignalError` where they are none."""
    check_size(
        even.name, even.values, even.period, LARGEST_HEIGHT, 'm',
        'the height of a road is meant in m, without hills: engine-mount drive --road makes it of a profile',
    )  # fmt: skip
    return resampled(even, step_time)
