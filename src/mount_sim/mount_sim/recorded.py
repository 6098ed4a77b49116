"""Recorded vertical acceleration as excitation: read, checked, resampled.

NPY: a file of values, with its times beside it (`x_value.npy` and `x_t.npy`), or a folder of such pairs.
CSV: a header line and columns. MCAP: a topic and a field. Refused are a missing file, an unknown column,
NaN, time that does not rise and gaps; each with the place where it was found.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mount_models.averages import mean
from mount_sim.csv_table import CsvTable, RecordedInputError, read_table
from mount_sim.resampling import change_rate, spline

__all__ = ['RecordedInputError', 'RecordedSignal', 'load_signal', 'resample']

LOWEST_RATE = 50.0  # Hz, chosen: 2.5 times the 20 Hz below which the engine moves on its mounts
LONGEST_GAP = 0.125  # s: one period of the eigenfrequency cannot be interpolated
_TIME_NAMES = ('t', 'time', 'timestamp', 'time_s', 't_s', 'seconds')


@dataclass(frozen=True)
class RecordedSignal:
    """A signal as recorded: times in s from its first sample and values, both (n,), and its name."""

    name: str
    times: NDArray[np.float64]
    values: NDArray[np.float64]

    @property
    def rate(self) -> float:
        """Median rate in Hz."""
        return 1.0 / float(np.median(np.diff(self.times)))


def load_signal(
    file: str | Path,
    *,
    column: str = '',
    time_column: str = '',
    topic: str = '',
) -> RecordedSignal:
    """Return the chosen signal of `file`, checked.

    `column` is a header name or number (CSV), a number or `signal.number` (NPY), or the field of the
    message such as `linear_acceleration.z` (MCAP, with `topic`).
    """
    path = Path(file)
    if not path.exists():
        raise RecordedInputError(
            f'{path} does not exist; give an existing CSV, NPY or MCAP file, or a folder of NPY files'
        )
    if (path.is_dir() and any(path.glob('*.mcap'))) or path.suffix == '.mcap':
        if not topic or not column:
            raise RecordedInputError(
                f'{path} is an MCAP recording: name a topic and a field, '
                'such as --topic /imu --column linear_acceleration.z'
            )
        name, (times, values) = f'{topic}.{column}', _load_mcap(path, topic, column)
    elif path.is_dir() or path.suffix == '.npy':
        name, times, values = _load_npy(path, column)
    elif path.suffix.lower() in ('.csv', '.txt'):
        return signal_of(read_table(path), column, time_column)
    else:
        raise RecordedInputError(
            f'{path.name}: files of type {path.suffix or "(none)"!s} are not read; use .csv, .npy or .mcap'
        )
    return _checked(RecordedSignal(name, times, values))


def signal_of(table: CsvTable, column: str, time_column: str = '') -> RecordedSignal:
    """Return the signal in `column` (header name or number) of a CSV file, checked."""
    header = list(table.header)
    value_place = _column_place(table.path, header, column, 'column')
    default_time = next((name for name in header if name.lower() in _TIME_NAMES), '0')
    time_place = _column_place(table.path, header, time_column or default_time, 'time column')
    times, values = table.columns(time_place, value_place)
    return _checked(RecordedSignal(header[value_place], times, values))


def resample(recorded: RecordedSignal, step_time: float) -> NDArray[np.float64]:
    """Return the signal at the plant's step (s), without its mean and without content it never had.

    First onto an even grid at its own rate, then band-limited (polyphase) to at least 1 kHz, then by a
    cubic spline to the step, where no more than 1/20 of the rate is in use.
    """
    rate = recorded.rate
    count = math.floor(recorded.times[-1] * rate + 1e-9) + 1
    even = spline(recorded.times, recorded.values - mean(recorded.values), np.arange(count) / rate)
    if rate * step_time > 1.0:
        ratio = Fraction(1.0 / (step_time * rate)).limit_denominator(1000)
        return change_rate(even, ratio.numerator, ratio.denominator)
    factor = max(1, math.ceil(1000.0 / rate))
    fine = change_rate(even, factor, 1)
    fine_times = np.arange(len(fine)) / (rate * factor)
    return spline(fine_times, fine, np.arange(0.0, recorded.times[-1], step_time))


def _checked(recorded: RecordedSignal) -> RecordedSignal:
    times, values = recorded.times, recorded.values
    if len(times) != len(values):
        raise RecordedInputError(
            f'{recorded.name}: {len(times)} times but {len(values)} values; both must be of equal length'
        )
    if len(times) < 10:
        raise RecordedInputError(f'{recorded.name} has {len(times)} samples; at least 10 are needed')
    for what, numbers in (('value', values), ('time', times)):
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise RecordedInputError(
                f'{recorded.name}: {what} number {bad[0]} is {numbers[bad[0]]} '
                f'({len(bad)} such of {len(numbers)}); remove or repair these samples first'
            )
    steps = np.diff(times)
    if np.any(steps <= 0.0):
        place = int(np.argmax(steps <= 0.0))
        raise RecordedInputError(
            f'{recorded.name}: time does not rise at sample {place + 1}: {times[place]:.6f} s is followed by '
            f'{times[place + 1]:.6f} s; sort the samples or remove the repeated ones'
        )
    if recorded.rate < LOWEST_RATE:
        raise RecordedInputError(
            f'{recorded.name} has {recorded.rate:.3g} samples per second (is its time in seconds?); '
            f'the engine needs at least {LOWEST_RATE:g}'
        )
    if steps.max() > LONGEST_GAP:
        place = int(steps.argmax())
        raise RecordedInputError(
            f'{recorded.name} has a gap of {steps.max():.3f} s at {times[place]:.3f} s; '
            f'up to {LONGEST_GAP:g} s are interpolated: cut the recording there'
        )
    return RecordedSignal(recorded.name, times - times[0], values)


def _load_npy(path: Path, column: str) -> tuple[str, NDArray[np.float64], NDArray[np.float64]]:
    pairs = _npy_pairs(path)
    wanted, _, index = column.rpartition('.')
    if not wanted and len(pairs) == 1:
        wanted = next(iter(pairs))
    shapes = {name: np.atleast_2d(_numbers(values).T).T for name, (values, _) in pairs.items()}
    known = ', '.join(f'{name} ({table.shape[1]} columns)' for name, table in shapes.items())
    if wanted not in pairs or (index and not index.isdigit()):
        raise RecordedInputError(
            f'column {column!r} names no signal in {path}; there are {known}; '
            f'choose as in --column {next(iter(pairs))}.0'
        )
    table = shapes[wanted]
    number = int(index) if index else 0
    if number >= table.shape[1] or (not index and table.shape[1] > 1):
        raise RecordedInputError(
            f'{wanted} in {path} has the columns 0 to {table.shape[1] - 1}; column {column!r} is none of them'
        )
    return f'{wanted}.{number}', _numbers(pairs[wanted][1]).ravel(), table[:, number]


def _load_mcap(path: Path, topic: str, field: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    from mount_sim.recorded_mcap import NoSuchSignalError, read_field  # needs ROS, the rest does not

    try:
        return read_field(path, topic, field)
    except NoSuchSignalError as error:
        raise RecordedInputError(str(error)) from None


def _npy_pairs(path: Path) -> dict[str, tuple[Path, Path]]:
    """Return {signal: (values file, times file)}."""
    files = [path] if path.is_file() else sorted(path.glob('*_value.npy'))
    pairs = {}
    for values in files:
        name = values.stem.removesuffix('_value')
        times = values.with_name(f'{name}_t.npy')
        if not times.exists():
            raise RecordedInputError(f'{values} has no times: {times.name} is missing beside it')
        pairs[name] = (values, times)
    if not pairs:
        raise RecordedInputError(f'{path} holds no pair of files x_value.npy and x_t.npy')
    return pairs


def _numbers(file: Path) -> NDArray[np.float64]:
    try:
        loaded = np.load(file, allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise RecordedInputError(f'{file} is no readable NPY file of numbers: {error}') from None
    if not isinstance(loaded, np.ndarray) or loaded.dtype.kind not in 'fiu' or not 1 <= loaded.ndim <= 2:
        what = f'{loaded.dtype} of shape {loaded.shape}' if isinstance(loaded, np.ndarray) else 'an archive'
        raise RecordedInputError(
            f'{file} holds {what}; needed are real numbers, (samples,) or (samples, columns)'
        )
    return loaded.astype(float)


def _column_place(path: Path, header: list[str], column: str, what: str) -> int:
    if column in header:
        return header.index(column)
    if column.isdigit() and int(column) < len(header):
        return int(column)
    raise RecordedInputError(f'{what} {column!r} is not in {path}; its columns are {", ".join(header)}')
