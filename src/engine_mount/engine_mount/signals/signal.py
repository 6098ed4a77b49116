"""A signal as it was recorded, and the sentences why one cannot be used."""

import importlib
from functools import reduce
from operator import add
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SECOND = 1_000_000_000  # ns
FEWEST = 10


class SignalError(ValueError):
    """A recorded signal cannot be used; the text says why, where, and what would help."""


class MissingLibraryError(ValueError):
    """A library is not installed; the text says what needs it and how it is installed."""


class Signal(NamedTuple):
    """Samples in the order of the file: times in s after `begin` (ns) and values, both (n,).

    `clock` says in words whose times they are, `notes` what of the recording is not in the samples.
    """

    name: str
    times: FloatArray
    values: FloatArray
    begin: int = 0
    clock: str = 'times'
    notes: tuple[str, ...] = ()


def signal_of(name: str, times: FloatArray, values: FloatArray) -> Signal:
    """Return the signal with `times` in s of any clock, both (n,); raises `SignalError`."""
    if len(times) != len(values):
        raise SignalError(
            f'{name}: {len(times)} times but {len(values)} values; both must be of equal length'
        )
    for what, numbers in (('value', values), ('time', times)):
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise SignalError(
                f'{name}: {what} number {bad[0]} is {numbers[bad[0]]} '
                f'({len(bad)} such of {len(numbers)}); remove or repair these samples first'
            )
    check_count(name, len(values))
    return Signal(name, times - times[0], values, round(SECOND * float(times[0])))


def mean(values: FloatArray) -> float:
    """Return the mean of `values`, (n,) with n > 0, to the bit that of `mount_models.arithmetic.sums`.

    It does not load numba's compiler, which takes 60 MB: an import at the rate of a drive needs none.
    """
    return reduce(add, values.data, 0.0) / values.size


def check_count(name: str, count: int, fewest: int = FEWEST) -> None:
    """Raise `SignalError` if a signal has too few samples to be one."""
    if count < fewest:
        raise SignalError(f'{name} has {count} samples; at least {fewest} are needed')


def check_order(name: str, times: FloatArray, remedy: str) -> None:
    """Raise `SignalError` where `times` (n,) in s go back."""
    back = np.flatnonzero(times[1:] < times[:-1])
    if back.size:
        place = int(back[0])
        raise SignalError(
            f'{name}: time does not rise at sample {place + 1}: {times[place]:.6f} s is followed by '
            f'{times[place + 1]:.6f} s; sort the samples, or {remedy}'
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


def required(module: str, what: str) -> ModuleType:
    """Return the module `module`; raises `MissingLibraryError` where it, or what it needs, is not installed.

    `what` is what needs it, as the subject of a sentence: 'reading s3:// places'.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingLibraryError(
            f'{what} needs the Python package {error.name or module}, which is not installed; '
            'make setup-desk installs it'
        ) from None
