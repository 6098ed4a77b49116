"""Recorded signals as excitation: the vertical acceleration of the chassis, the height of the road."""

from dataclasses import replace
from pathlib import Path

from engine_mount.recordings.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.recordings.signals.loading import load_signal
from engine_mount.recordings.signals.plausibility import check_size
from engine_mount.recordings.signals.resampling import resampled
from mount_models.arithmetic.averages import mean
from mount_models.arithmetic.series import StreamedSeries

LOWEST_RATE = 50.0  # Hz, chosen: 2.5 times the 20 Hz below which the engine moves on its mounts
LONGEST_GAP = 0.125  # s: one period of the eigenfrequency cannot be interpolated
LARGEST_ACCELERATION = 50.0
"""m/s^2, chosen: five times gravity shakes no chassis but in a crash, and is soon reached by a wrong unit."""
LOWEST_ROAD_RATE = 100.0  # Hz, chosen: a road is of use up to 40 Hz at least
LONGEST_ROAD_GAP = 0.02  # s, chosen: half a period of the wheel's own mode is interpolated, no more
LARGEST_HEIGHT = 1.0
"""m, chosen: no wheel runs over more without a hill, which has no place in an excitation."""


def recorded_acceleration(
    file: str | Path, *, column: str = '', time_column: str = '', topic: str = ''
) -> EvenSignal:
    """Return the chosen signal of `file` evenly spaced, in its own unit; raises `SignalError`."""
    signal = load_signal(Path(file), column=column, time_column=time_column, topic=topic)
    return evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)


def acceleration_at(even: EvenSignal, scale: float, step_time: float) -> StreamedSeries:
    """Return the acceleration (n,) in m/s^2 at steps of `step_time` (s), without its mean.

    Raises `SignalError`, with the sample, beyond `LARGEST_ACCELERATION`.
    """
    values = even.values - mean(even.values)
    check_size(
        even.name, scale * values, even.period, LARGEST_ACCELERATION, 'm/s^2 without the mean',
        'a chassis is not shaken so (the limit is chosen): is its unit another one (--scale), the column no '
        'acceleration, or this sample a fault to cut or repair?',
    )  # fmt: skip
    plain = resampled(replace(even, values=values), step_time)
    return StreamedSeries(len(plain), lambda first, behind: scale * plain[first:behind])


def measured_height(file: str | Path) -> EvenSignal:
    """Return the height (m) in `file` over time (s), evenly spaced; raises `SignalError`."""
    signal = load_signal(Path(file), column='1' if str(file).endswith('.csv') else '')
    return evenly_spaced(signal, LONGEST_ROAD_GAP, LOWEST_ROAD_RATE)


def height_at(even: EvenSignal, step_time: float) -> StreamedSeries:
    """Return the heights (n,) in m at steps of `step_time` (s); raises `SignalError` where they are none."""
    check_size(
        even.name, even.values, even.period, LARGEST_HEIGHT, 'm',
        'the height of a road is meant in m, without hills: engine-mount drive --road makes it of a profile',
    )  # fmt: skip
    return resampled(even, step_time)
