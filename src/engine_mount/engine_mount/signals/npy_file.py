"""NPY files: a signal is a pair of files, `x_value.npy` and `x_t.npy`; a folder holds several."""

from pathlib import Path

import numpy as np

from engine_mount.signals.signal import FloatArray, Signal, SignalError, signal_of


def read_npy(path: Path, column: str) -> Signal:
    """Return the column `signal.number` of a values file or a folder of them, or raise `SignalError`.

    Signal or number may be left out where there is only one.
    """
    pairs = _pairs(path)
    wanted, _, index = column.rpartition('.')
    if not wanted and len(pairs) == 1:
        wanted = next(iter(pairs))
    tables = {name: np.atleast_2d(_numbers(values).T).T for name, (values, _) in pairs.items()}
    known = ', '.join(f'{name} ({table.shape[1]} columns)' for name, table in tables.items())
    if wanted not in pairs or (index and not index.isdecimal()):
        raise SignalError(
            f'column {column!r} names no signal in {path}; there are {known}; '
            f'choose as in --column {next(iter(pairs))}.0'
        )
    table = tables[wanted]
    number = int(index) if index else 0
    if number >= table.shape[1] or (not index and table.shape[1] > 1):
        raise SignalError(
            f'{wanted} in {path} has the columns 0 to {table.shape[1] - 1}; column {column!r} is none of them'
        )
    return signal_of(f'{wanted}.{number}', _numbers(pairs[wanted][1]).ravel(), table[:, number])


def _pairs(path: Path) -> dict[str, tuple[Path, Path]]:
    """Return {signal: (values file, times file)}."""
    files = [path] if path.is_file() else sorted(path.glob('*_value.npy'))
    pairs = {}
    for values in files:
        name = values.stem.removesuffix('_value')
        times = values.with_name(f'{name}_t.npy')
        if not times.exists():
            raise SignalError(f'{values} has no times: {times.name} is missing beside it')
        pairs[name] = (values, times)
    if not pairs:
        raise SignalError(f'{path} holds no pair of files x_value.npy and x_t.npy')
    return pairs


def _numbers(file: Path) -> FloatArray:
    try:
        loaded = np.load(file, allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise SignalError(f'{file} is no readable NPY file of numbers: {error}') from None
    if not isinstance(loaded, np.ndarray) or loaded.dtype.kind not in 'fiu' or not 1 <= loaded.ndim <= 2:
        what = f'{loaded.dtype} of shape {loaded.shape}' if isinstance(loaded, np.ndarray) else 'an archive'
        raise SignalError(f'{file} holds {what}; needed are real numbers, (samples,) or (samples, columns)')
    return loaded.astype(float)
