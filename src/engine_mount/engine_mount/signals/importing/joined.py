"""Signals of several files on one time axis."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from engine_mount.signals.signal import SECOND, Signal, SignalError

Signals = dict[str, Signal]
DATED = 500_000_000 * SECOND
"""ns, 1985: what begins later counts from 1970, and is no clock of its own."""


def joined(files: Sequence[tuple[str, Signals]]) -> tuple[Signals, list[str]]:
    """Return the signals of all files, (name, signals) each, on one axis, and sentences on how.

    Files with dates keep them; files that count from a zero of their own are taken to have begun together.
    A quantity in several files continues from one to the next. Raises `SignalError` where it overlaps, where
    its files have no dates, and where some files have dates and others none.
    """
    dated = {name: _dated(signals) for name, signals in files}
    if len(set(dated.values())) > 1:
        undated = ', '.join(name for name, told in dated.items() if not told)
        raise SignalError(
            f'{undated} tells no date, the other files do: when they began against each other is not known; '
            'import them apart'
        )
    notes = []
    if len(files) > 1 and not any(dated.values()):
        notes.append('the files tell no dates: their times are taken to count from the same zero')
    found: dict[str, list[tuple[str, Signal]]] = {}
    for name, signals in files:
        for quantity, signal in signals.items():
            found.setdefault(quantity, []).append((name, signal))
    return {quantity: _continued(quantity, parts) for quantity, parts in found.items()}, notes


def _dated(signals: Signals) -> bool:
    return all(signal.begin > DATED for signal in signals.values())


def _continued(quantity: str, parts: list[tuple[str, Signal]]) -> Signal:
    """Return the signals of several files one behind the other."""
    if len(parts) == 1:
        return parts[0][1]
    parts = sorted(parts, key=lambda part: part[1].begin)
    for (name, before), (next_name, after) in pairwise(parts):
        end = before.begin + round(SECOND * float(before.times[-1]))
        if after.begin <= end:
            raise SignalError(
                f'{quantity} is in {name} until {end / SECOND:.3f} s and in {next_name} from '
                f'{after.begin / SECOND:.3f} s: they overlap; name in which file it is, or import them apart'
            )
    first = parts[0][1]
    shifts = [(signal.begin - first.begin) / SECOND for _, signal in parts]
    return replace(
        first,
        times=np.concatenate([s.times + shift for (_, s), shift in zip(parts, shifts, strict=True)]),
        values=np.concatenate([signal.values for _, signal in parts]),
        notes=tuple(dict.fromkeys(note for _, signal in parts for note in signal.notes)),
    )
