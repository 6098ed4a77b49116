"""Signals in SI as they are recorded: those that drive something at its rate, others as sampled."""

from collections.abc import Mapping

import numpy as np

from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LOWEST_RATE as LOWEST_RATE_OF_ACCELERATION
from engine_mount.signals.importing.one_grid import (
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    LOWEST_RATE,
    displacement_on_grid,
    rate_text,
)
from engine_mount.signals.importing.pieces import LONGEST_GAP
from engine_mount.signals.importing.topics import recorded_as
from engine_mount.signals.importing.writing import Channel, Times
from engine_mount.signals.quantities import Quantity, quantity
from engine_mount.signals.resampling import has_step, resampled
from engine_mount.signals.signal import SECOND, FloatArray, Signal, SignalError, check_size
from mount_control.settings import ControlParameters
from mount_models.sampling import SAMPLE_RATE, sample_time_ns


def channels_of(
    signals: Mapping[str, Signal], quantities: Mapping[str, Quantity]
) -> tuple[list[Channel], list[str]]:
    """Return what is recorded of `signals` (SI, without long gaps), and sentences on what was done.

    Raises `SignalError` for what no command could follow.
    """
    notes: list[str] = []
    channels = []
    pair = [name for name in (DISPLACEMENT, ENGINE, CHASSIS) if name in signals]
    if DISPLACEMENT in pair:
        channels.append(_displacement({DISPLACEMENT: signals[DISPLACEMENT]}, notes))
    elif len(pair) == 2:
        channels.append(_displacement({name: signals[name] for name in pair}, notes))
    for name, signal in signals.items():
        if name == DISPLACEMENT:
            continue
        if name == 'acceleration':
            stamps, values = _acceleration(signal, channels[0].stamps if pair and channels else None, notes)
        else:
            stamps, values = _as_sampled(signal)
        known = (one.stamps for one in channels)
        shared = next((each for each in known if each is stamps or np.array_equal(each, stamps)), stamps)
        channels.append(Channel(recorded_as(quantities[name]), quantities[name].unit.symbol, shared, values))
    return channels, notes


def _displacement(signals: Mapping[str, Signal], notes: list[str]) -> Channel:
    even = {name: evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE) for name, signal in signals.items()}
    for one in even.values():
        notes += [note for note in one.notes if note not in notes]
    stamps, values = displacement_on_grid(even, SAMPLE_RATE, notes)
    limit = ControlParameters().displacement_range
    check_size(
        ' and '.join(one.name for one in even.values()), values, 1.0 / SAMPLE_RATE, limit, 'm',
        'is its unit another one, its zero another offset (in a mapping file), or is this sample a fault to '
        'cut out?',
    )  # fmt: skip
    wanted = quantity(DISPLACEMENT)
    return Channel(recorded_as(wanted), wanted.unit.symbol, stamps, values)


def _acceleration(signal: Signal, grid: Times | None, notes: list[str]) -> tuple[Times, FloatArray]:
    """Return the acceleration at the rate that its topic has; its stamps are those of `grid` if equal."""
    even = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE_OF_ACCELERATION)
    notes += [note for note in even.notes if note not in notes]
    step = 1.0 / SAMPLE_RATE
    if not has_step(even, step):
        notes.append(
            f'{even.name}: resampled from {even.rate:.4g} Hz to {rate_text(SAMPLE_RATE)}, band-limited'
        )
    values = resampled(even, step, 0.0, round(even.length / step) + 1)[:]
    step_ns = sample_time_ns(SAMPLE_RATE)
    if grid is not None and (int(grid[0]), grid.size) == (even.begin, values.size):
        return grid, values
    return np.arange(even.begin, even.begin + values.size * step_ns, step_ns, dtype=np.int64), values


def _as_sampled(signal: Signal) -> tuple[Times, FloatArray]:
    stamps = signal.begin + np.rint(SECOND * signal.times).astype(np.int64)
    back = np.flatnonzero(np.diff(stamps) < 0)
    if back.size:
        place = int(back[0])
        raise SignalError(
            f'{signal.name}: time goes back at sample {place + 1}, from {signal.times[place]:.6f} s to '
            f'{signal.times[place + 1]:.6f} s; sort the samples, or cut the file there'
        )
    return stamps, signal.values
