"""How one signal differs between two recordings: its samples side by side, figures, sentences, a table."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.screen import Table
from engine_mount.recordings.tolerances import Tolerance
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

Values = NDArray[np.float64]
Places = NDArray[np.int64]

SHOWN = 6  # signals, switchings, session entries named one by one
_ROWS = 10  # of the table
_RANKS = {
    f'{CURRENT_SETPOINT.name}.coil_current': 0,
    f'{CONTROL_TRACE.name}.current': 1,
    f'{DISPLACEMENT.name}.mount': 2,
}


@dataclass(frozen=True)
class Moment:
    """One matched sample: time in s, values in A and B."""

    time: float
    a: float
    b: float

    @property
    def difference(self) -> float:
        """B minus A."""
        return self.b - self.a

    def figures(self) -> dict[str, float | None]:
        """Return the figures for JSON."""
        numbers = {'a': self.a, 'b': self.b, 'difference': self.difference}
        return {'time_s': self.time, **{name: known(number) for name, number in numbers.items()}}


@dataclass(frozen=True)
class Quantity:
    """Where a signal is from and its unit; `mount` stands before the topic: `mount_left/`, or nothing."""

    mount: str
    topic: str
    signal: str
    unit: str


@dataclass(frozen=True)
class Column:
    """One signal of matched samples: times (s), values in A and B."""

    quantity: Quantity
    time: Values
    a: Values
    b: Values

    def at(self, place: int) -> Moment:
        """Return one sample."""
        return Moment(float(self.time[place]), float(self.a[place]), float(self.b[place]))


@dataclass(frozen=True)
class SignalDifference(Quantity):
    """One signal in both recordings; values in `unit`, unknown is NaN.

    `differing` samples are beyond the tolerance; NaN in one recording alone always is, NaN in both never.
    `first` is the first of them, `largest` the sample with the largest difference of numbers; `rms` is that
    of the differences of numbers over all samples; B is `lag` s later. `exact`: all are equal to the bit.
    """

    samples: int
    differing: int = 0
    exact: bool = True
    unknown_in_one: int = 0
    first: Moment | None = None
    largest: Moment | None = None
    rms: float = 0.0
    scale: float = math.nan
    lag: float = math.nan

    @property
    def name(self) -> str:
        """Mount, topic and signal."""
        return f'{self.mount}{self.topic}.{self.signal}'

    def importance(self) -> tuple[int, bool, float, str]:
        """Return the key of the order: output, input, share of the largest value; the simulator's last."""
        rank = _RANKS.get(f'{self.topic}.{self.signal}', len(_RANKS))
        told = self.largest is not None and self.scale > 0.0
        share = abs(self.largest.difference) / self.scale if told and self.largest else 1.0
        return rank, self.topic.startswith('sim/'), -share, self.name

    def sentence(self, b: str = 'B') -> str:
        """Return the difference in words; `b` names B."""
        since = '' if self.first is None else f', first at {time_text(self.first.time)}'
        verb = 'sample is' if self.unknown_in_one == 1 else 'samples are'
        unknown = f'in one of them {self.unknown_in_one} {verb} unknown' if self.unknown_in_one else ''
        if self.largest is None:
            return f'{self.name}: {unknown}{since}'
        behind = f'; {unknown}' if unknown else ''
        if self.largest.difference == 0.0:
            return f'{self.name} differs in the sign of zero{since}{behind}'
        if abs(self.lag) >= _LEAST_LAG:
            word = 'later' if self.lag > 0.0 else 'earlier'
            behind = f'; {b} is {1e3 * abs(self.lag):.2f} ms {word}{behind}'
        most = quantity_text(abs(self.largest.difference), self.unit)
        return f'{self.name} differs by at most {most} at {time_text(self.largest.time)}{since}{behind}'

    def row(self) -> tuple[str, ...]:
        """Return the difference as the cells of a table."""
        late = f'{1e3 * self.lag:.2f} ms' if abs(self.lag) >= _LEAST_LAG else '0'
        return (
            f'{self.mount}{self.topic}\n{self.signal}',  # two lines, so that all fits into 80 characters
            str(self.differing),
            '' if self.first is None else f'{self.first.time:.3f}',
            'unknown' if self.largest is None else quantity_text(abs(self.largest.difference), self.unit),
            '' if self.largest is None else f'{self.largest.time:.3f}',
            quantity_text(self.rms, self.unit),
            '-' if math.isnan(self.lag) else late,
        )

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            **{
                name: getattr(self, name)
                for name in ('unit', 'samples', 'differing', 'exact', 'unknown_in_one')
            },
            'first': self.first and self.first.figures(),
            'largest': self.largest and self.largest.figures(),
            'rms': known(self.rms),
            'lag_ms': known(1e3 * self.lag),
        }


def signal_difference(
    column: Column, tolerance: Tolerance, places: Places | None, period: float
) -> SignalDifference:
    """Return how the two sides of `column` differ beyond `tolerance`.

    `places` numbers the samples in periods (s), for the lag; None where they have no rate.
    """
    origin = asdict(column.quantity)
    a, b = np.ascontiguousarray(column.a, float), np.ascontiguousarray(column.b, float)
    unknown_a, unknown_b = np.isnan(a), np.isnan(b)
    same = (a.view(np.int64) == b.view(np.int64)) | (unknown_a & unknown_b)
    scale = float(np.abs(a[np.isfinite(a)]).max(initial=0.0))
    if same.all():
        return SignalDifference(**origin, samples=len(a), scale=scale)
    with np.errstate(invalid='ignore'):
        distance = np.where(same, 0.0, np.abs(b - a))
    bound, numbers = tolerance.bound(scale), ~(unknown_a | unknown_b)
    # Without a tolerance even the sign of a zero counts.
    differing = np.flatnonzero(~same & (~numbers | ~(distance <= bound) | (bound == 0.0)))
    distances = distance[numbers]
    unlike = (numbers & ~same).any()
    return SignalDifference(
        **origin,
        samples=len(a),
        differing=len(differing),
        exact=False,
        unknown_in_one=int(np.count_nonzero(unknown_a != unknown_b)),
        first=column.at(int(differing[0])) if len(differing) else None,
        largest=column.at(int(np.flatnonzero(numbers)[np.argmax(distances)])) if unlike else None,
        rms=float(np.sqrt(np.mean(distances**2))) if len(distances) else math.nan,
        scale=scale,
        lag=math.nan if places is None else lag(_evenly(a, places), _evenly(b, places), period),
    )


def by_importance(signals: Iterable[SignalDifference]) -> list[SignalDifference]:
    """Return the differing ones among `signals`, the most important first."""
    return sorted((signal for signal in signals if signal.differing), key=SignalDifference.importance)


def signal_sentences(signals: Iterable[SignalDifference], b: str = 'B') -> list[str]:
    """Return the sentences about the most important of the differing `signals`; `b` names B."""
    ordered = by_importance(signals)
    others = [signal.name for signal in ordered[SHOWN:]]
    more = [f'{len(others)} more signals differ: {few(others, ", ")}'] if others else []
    return [*(signal.sentence(b) for signal in ordered[:SHOWN]), *more]


def signal_table(signals: Iterable[SignalDifference]) -> Table:
    """Return the most important of the differing signals as a table."""
    ordered = by_importance(signals)
    more = len(ordered) - _ROWS
    return Table(
        'The largest differences',
        'lrrrrrr',
        [signal.row() for signal in ordered[:_ROWS]],
        ('signal', 'samples', 'first (s)', 'largest', 'at (s)', 'rms', 'B later'),
        f'{more} more differ; see --json' if more > 0 else '',
    )


def few(names: Sequence[str], separator: str) -> str:
    """Return the first names, and how many more there are."""
    more = f'{separator}{len(names) - SHOWN} more' if len(names) > SHOWN else ''
    return separator.join(names[:SHOWN]) + more


def known(value: float) -> float | None:
    """Return a number as JSON knows it: unknown is null."""
    return value if math.isfinite(value) else None


def _evenly(values: Values, places: Places) -> Values:
    """Return `values` with missing samples replaced by a straight line."""
    count = int(places[-1] - places[0]) + 1
    return values if count == len(places) else np.interp(np.arange(count), places - places[0], values)


# The lag.

_LEAST_LAG = 0.05e-3  # s, chosen: below, the estimate says nothing
_LONGEST_LAG = 0.5  # s, chosen
_LEAST_SAMPLES = 64  # chosen
_LEAST_CORRELATION = 0.8  # chosen: below, the shapes are not the same and a lag means nothing
_AS_GOOD = 0.99  # of the highest correlation, chosen: then the shorter lag is the answer
_EXPLAINED = 0.5  # chosen: of what remains unlike without a shift, a lag must take away so much
_IN_STEP = 0.1  # samples, chosen: a shorter lag is none and need not explain anything


def lag(a: Values, b: Values, period: float) -> float:
    """Return by how many s `b` is later than `a`, both sampled every `period` (s) from the same time on.

    The lag is that of the highest correlation coefficient within half a second and a quarter of the length,
    refined below one sample by a parabola; of several as good, as with a periodic signal, the shortest. NaN
    where shapes differ or no shift makes the signals clearly more alike. NaNs in signals count as the mean.
    """
    one, other = _centred(a), _centred(b)
    if len(one) < _LEAST_SAMPLES or not (one.any() and other.any()):
        return math.nan
    reach = max(1, min(round(_LONGEST_LAG / period), len(one) // 4))
    found = _correlation(one, other, reach)
    good = 1 + np.flatnonzero(
        (found[1:-1] >= found[:-2]) & (found[1:-1] > found[2:]) & (found[1:-1] >= _AS_GOOD * found.max())
    )
    if found.max() < _LEAST_CORRELATION or not len(good):
        return math.nan
    place = int(good[np.argmin(np.abs(good - reach))])
    before, at, after = found[place - 1 : place + 2].tolist()
    bend, slope = before - 2.0 * at + after, 0.5 * (after - before)
    offset = -slope / bend if bend < 0.0 else 0.0
    shift = place - reach + offset
    unlike = 1.0 - (at + 0.5 * slope * offset)
    if abs(shift) > _IN_STEP and unlike > (1.0 - _EXPLAINED) * (1.0 - found[reach]):
        return math.nan
    return float(shift) * period


def _centred(signal: Values) -> Values:
    finite = np.isfinite(signal)
    values = signal[finite]
    if not len(values) or (values == values[0]).all():
        return np.zeros(len(signal))  # else rounding of the mean would make a signal of a constant
    return np.where(finite, signal - values.mean(), 0.0)


def _correlation(a: Values, b: Values, reach: int) -> Values:
    """Return the correlation coefficients of `a[i]` and `b[i + k]` for k from -reach to reach."""
    count, shifts = len(a), np.arange(-reach, reach + 1)
    size = 1 << (count + reach).bit_length()
    products = np.fft.irfft(np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size), size)
    # Energy of what overlaps at each shift, so that a shift does not lower the coefficient by itself.
    energy_a, energy_b = (np.concatenate([[0.0], np.cumsum(signal**2)]) for signal in (a, b))
    begin, end = np.maximum(0, -shifts), count - np.maximum(0, shifts)
    energies = (energy_a[end] - energy_a[begin]) * (energy_b[end + shifts] - energy_b[begin + shifts])
    least = 1e-12 * energy_a[-1] * energy_b[-1]  # an overlap without signal says nothing
    return np.where(energies > least, products[shifts] / np.sqrt(np.maximum(energies, least)), 0.0)


# Numbers with units as people read them: 0.031 A, 12.5 µm, 3.2 ms.

_SMALLER = {
    'm': (('m', 1.0), ('mm', 1e-3), ('µm', 1e-6), ('nm', 1e-9)),
    's': (('s', 1.0), ('ms', 1e-3), ('µs', 1e-6)),
}
_ROUNDED_UP = 0.9995


def quantity_text(value: float, unit: str, digits: int = 3) -> str:
    """Return `value` (in `unit`, SI) with `digits` significant digits, lengths and times in a handy unit."""
    if math.isnan(value):
        return 'unknown'
    steps = _SMALLER.get(unit, ((unit, 1.0),))
    fitting = (step for step in steps if value == 0.0 or abs(value) >= _ROUNDED_UP * step[1])
    name, size = next(fitting, steps[-1])
    return f'{value / size:.{digits}g} {name}'.rstrip()


def time_text(seconds: float) -> str:
    """Return a time on the axis of a recording, to the millisecond."""
    return f'{seconds:.3f} s'
