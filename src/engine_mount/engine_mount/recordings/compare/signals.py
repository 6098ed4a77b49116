"""How one signal differs between two recordings: its samples side by side, figures, sentences, a table."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.compare.lag import Lag, lag
from engine_mount.recordings.compare.quantity_text import quantity_text, time_text
from engine_mount.recordings.compare.tolerances import Tolerance
from engine_mount.recordings.run.screen import Table
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

Values = NDArray[np.float64]

SHOWN = 6  # signals, switchings, session entries named one by one
_ROWS = 10  # of the table
_LEAST_LAG = 0.05e-3  # s, chosen: below, the estimate says nothing
_NO_LAG = Lag(math.nan)
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
    of the differences of numbers over all samples. `exact` says that all samples are equal to the bit.
    """

    samples: int
    differing: int = 0
    exact: bool = True
    unknown_in_one: int = 0
    first: Moment | None = None
    largest: Moment | None = None
    rms: float = 0.0
    scale: float = math.nan
    lag: Lag = _NO_LAG

    @property
    def name(self) -> str:
        """Mount, topic and signal."""
        return f'{self.mount}{self.topic}.{self.signal}'

    @property
    def share(self) -> float:
        """The largest difference as a share of the largest value in A; 1 where it cannot be told."""
        if self.largest is None or not self.scale > 0.0:
            return 1.0
        return abs(self.largest.difference) / self.scale

    def sentence(self, b: str = 'B') -> str:
        """Return the difference in words; `b` is what B is called."""
        since = '' if self.first is None else f', first at {time_text(self.first.time)}'
        verb = 'sample is' if self.unknown_in_one == 1 else 'samples are'
        unknown = f'in one of them {self.unknown_in_one} {verb} unknown' if self.unknown_in_one else ''
        if self.largest is None:
            return f'{self.name}: {unknown}{since}'
        behind = f'; {unknown}' if unknown else ''
        if self.largest.difference == 0.0:
            return f'{self.name} differs in the sign of zero{since}{behind}'
        most = quantity_text(abs(self.largest.difference), self.unit)
        at = time_text(self.largest.time)
        return f'{self.name} differs by at most {most} at {at}{since}{self._lag_words(b)}{behind}'

    def row(self) -> tuple[str, ...]:
        """Return the difference as the cells of a table."""
        largest, lag = self.largest, self.lag
        late = f'{1e3 * lag.seconds:.2f} ms' if abs(lag.seconds) >= _LEAST_LAG else '0'
        return (
            f'{self.mount}{self.topic}\n{self.signal}',  # two lines, so that all fits into 80 characters
            str(self.differing),
            '' if self.first is None else f'{self.first.time:.3f}',
            'unknown' if largest is None else quantity_text(abs(largest.difference), self.unit),
            '' if largest is None else f'{largest.time:.3f}',
            quantity_text(self.rms, self.unit),
            late if lag.known else '-',
        )

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        names = ('unit', 'samples', 'differing', 'exact', 'unknown_in_one')
        return {
            **{name: value for name, value in asdict(self).items() if name in names},
            'first': self.first and self.first.figures(),
            'largest': self.largest and self.largest.figures(),
            'rms': known(self.rms),
            'lag_ms': known(1e3 * self.lag.seconds),
            'lag_remark': self.lag.remark,
        }

    def _lag_words(self, b: str) -> str:
        if not self.lag.known or abs(self.lag.seconds) < _LEAST_LAG:
            return ''
        word = 'later' if self.lag.seconds > 0.0 else 'earlier'
        remark = f' ({self.lag.remark})' if self.lag.remark else ''
        return f'; {b} is {1e3 * abs(self.lag.seconds):.2f} ms {word}{remark}'


def signal_difference(
    column: Column, tolerance: Tolerance, places: NDArray[np.int64] | None, period: float
) -> SignalDifference:
    """Return how the two sides of `column` differ beyond `tolerance`.

    `places` numbers the samples in periods (s), for the lag; None where they have no rate.
    """
    origin = asdict(column.quantity)
    a, b = np.ascontiguousarray(column.a, float), np.ascontiguousarray(column.b, float)
    unknown_a, unknown_b = np.isnan(a), np.isnan(b)
    same = (a.view(np.int64) == b.view(np.int64)) | (unknown_a & unknown_b)
    numbers = ~(unknown_a | unknown_b)
    scale = float(np.abs(a[np.isfinite(a)]).max(initial=-1.0))
    scale = scale if scale >= 0.0 else math.nan
    if same.all():
        return SignalDifference(**origin, samples=len(a), scale=scale)
    with np.errstate(invalid='ignore'):
        distance = np.where(same, 0.0, np.abs(b - a))
    bound = tolerance.bound(0.0 if math.isnan(scale) else scale)
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
        lag=_NO_LAG if places is None else lag(_evenly(a, places), _evenly(b, places), period),
    )


def by_importance(signals: Iterable[SignalDifference]) -> list[SignalDifference]:
    """Return the differing ones among `signals`: the output, the input, then by their share of the signal.

    What only a simulator knows comes last.
    """

    def importance(signal: SignalDifference) -> tuple[int, bool, float, str]:
        rank = _RANKS.get(f'{signal.topic}.{signal.signal}', len(_RANKS))
        return rank, signal.topic.startswith('sim/'), -signal.share, signal.name

    return sorted((signal for signal in signals if signal.differing), key=importance)


def signal_sentences(signals: Iterable[SignalDifference], b: str = 'B') -> list[str]:
    """Return the sentences about the most important of the differing `signals`; `b` is what B is called."""
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


def _evenly(values: Values, places: NDArray[np.int64]) -> Values:
    """Return `values` with missing samples replaced by a straight line."""
    count = int(places[-1] - places[0]) + 1
    if count == len(places):
        return values
    return np.interp(np.arange(count), places - places[0], values)
