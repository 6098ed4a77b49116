"""How one signal differs between two recordings: its samples side by side, figures, sentences, a table."""

import math
import re
from collections.abc import Collection, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.screen import Table
from mount_models.arithmetic.sums import mean
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

Values = NDArray[np.float64]
Places = NDArray[np.int64]

SWITCHING = 'switching'
_ALL = ''
_FORM = re.compile(r'(?:(?P<name>[^=\s]+)=)?(?P<value>\d*\.?\d+(?:[eE][-+]?\d+)?)(?P<percent>%?)')
SHOWN = 6  # signals, switchings, session entries named one by one
_ROWS = 10  # of the table
_RANKS = {
    f'{CURRENT_SETPOINT.name}.coil_current': 0,
    f'{CONTROL_TRACE.name}.current': 1,
    f'{DISPLACEMENT.name}.mount': 2,
}


class ToleranceError(ValueError):
    """A tolerance is not understood or names no signal; the text says how to write it."""


class Tolerance(NamedTuple):
    """A bound on the difference: in the signal's unit, or as a share of its largest value in A."""

    value: float = 0.0
    relative: bool = False

    def bound(self, largest: float) -> float:
        """Return the bound in the unit of the signal, whose largest absolute value is `largest`."""
        return self.value * largest if self.relative else self.value


EXACT = Tolerance()


class Tolerances:
    """The tolerances of a comparison by signal, topic, or for all signals."""

    def __init__(self, texts: Iterable[str] = ()):
        """Read `NAME=0.01`, `NAME=1%` or, for all signals, `1%`; raises `ToleranceError`.

        NAME is a signal (`current`), a topic (`current_setpoint`), both (`control_trace.current`), or
        `switching` for the times of switching in s.
        """
        self._by_name = dict(map(_read, texts))

    def of(self, topic: str, signal: str) -> Tolerance:
        """Return the tolerance of a signal; the name that says most counts."""
        names = (f'{topic}.{signal}', signal, topic, _ALL)
        return next((self._by_name[name] for name in names if name in self._by_name), EXACT)

    @property
    def switching(self) -> float:
        """By how much a switching may move, s."""
        return self._by_name.get(SWITCHING, EXACT).value

    def check(self, known: Collection[tuple[str, str]]) -> None:
        """Raise `ToleranceError` for a name that is none of `known` (topic, signal)."""
        names = {SWITCHING, _ALL}
        for topic, signal in known:
            names |= {signal, topic, f'{topic}.{signal}'}
        for unknown in self._by_name.keys() - names:
            raise ToleranceError(
                f'tolerance for {unknown!r}: no such signal in both recordings; --json lists all signals'
            )


def _read(text: str) -> tuple[str, Tolerance]:
    match = _FORM.fullmatch(text.strip())
    if match is None:
        raise ToleranceError(f'tolerance {text!r}: write NAME=VALUE as current=0.01, or NAME=1%, or 1%')
    value = float(match['value'])
    name, relative = match['name'] or _ALL, bool(match['percent'])
    if name == _ALL and not relative:
        raise ToleranceError(
            f'tolerance {text!r} would mean another thing in each unit; name a signal or write a share: 1%'
        )
    if name == SWITCHING and relative:
        raise ToleranceError('the tolerance of switching is a time in s, such as switching=0.002')
    return name, Tolerance(value / 100.0 if relative else value, relative)


class Moment(NamedTuple):
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


class Column(NamedTuple):
    """One signal of matched samples: times (s), values in A and B.

    `mount` is the part of its name before the topic: `mount_left/`, or nothing.
    """

    mount: str
    topic: str
    signal: str
    unit: str
    time: Values
    a: Values
    b: Values

    def at(self, place: int) -> Moment:
        """Return one sample."""
        return Moment(float(self.time[place]), float(self.a[place]), float(self.b[place]))


class SignalDifference(NamedTuple):
    """One signal in both recordings; values in `unit`, unknown is NaN.

    `differing` samples are beyond the tolerance; NaN in one recording alone always is, NaN in both never.
    `first` is the first of them, `largest` the sample with the largest difference of numbers; `rms` is that
    of the differences of numbers over all samples. `exact`: all are equal to the bit.
    """

    mount: str
    topic: str
    signal: str
    unit: str
    samples: int
    differing: int = 0
    exact: bool = True
    unknown_in_one: int = 0
    first: Moment | None = None
    largest: Moment | None = None
    rms: float = 0.0
    scale: float = math.nan

    @property
    def name(self) -> str:
        """Mount, topic and signal."""
        return f'{self.mount}{self.topic}.{self.signal}'

    def importance(self) -> tuple[int, bool, float, str]:
        """Return the key of the order: output, input, share of the largest value; the simulator's last."""
        rank = _RANKS.get(f'{self.topic}.{self.signal}', len(_RANKS))
        share = abs(self.largest.difference) / self.scale if self.largest and self.scale > 0.0 else 1.0
        return rank, self.topic.startswith('sim/'), -share, self.name

    @property
    def sentence(self) -> str:
        """The difference in words."""
        since = '' if self.first is None else f', first at {time_text(self.first.time)}'
        verb = 'sample is' if self.unknown_in_one == 1 else 'samples are'
        unknown = f'in one of them {self.unknown_in_one} {verb} unknown' if self.unknown_in_one else ''
        if self.largest is None:
            return f'{self.name}: {unknown}{since}'
        behind = f'; {unknown}' if unknown else ''
        if self.largest.difference == 0.0:
            return f'{self.name} differs in the sign of zero{since}{behind}'
        most = quantity_text(abs(self.largest.difference), self.unit)
        return f'{self.name} differs by at most {most} at {time_text(self.largest.time)}{since}{behind}'

    def row(self) -> tuple[str, ...]:
        """Return the difference as the cells of a table."""
        return (
            f'{self.mount}{self.topic}\n{self.signal}',  # two lines, so that all fits into 80 characters
            str(self.differing),
            '' if self.first is None else f'{self.first.time:.3f}',
            'unknown' if self.largest is None else quantity_text(abs(self.largest.difference), self.unit),
            '' if self.largest is None else f'{self.largest.time:.3f}',
            quantity_text(self.rms, self.unit),
        )

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            'unit': self.unit,
            'samples': self.samples,
            'differing': self.differing,
            'exact': self.exact,
            'unknown_in_one': self.unknown_in_one,
            'first': self.first and self.first.figures(),
            'largest': self.largest and self.largest.figures(),
            'rms': known(self.rms),
        }


def signal_difference(column: Column, tolerance: Tolerance) -> SignalDifference:
    """Return how the two sides of `column` differ beyond `tolerance`."""
    origin = column.mount, column.topic, column.signal, column.unit
    a, b = np.ascontiguousarray(column.a, float), np.ascontiguousarray(column.b, float)
    unknown_a, unknown_b = np.isnan(a), np.isnan(b)
    same = (a.view(np.int64) == b.view(np.int64)) | (unknown_a & unknown_b)
    scale = float(np.abs(a[np.isfinite(a)]).max(initial=0.0))
    if same.all():
        return SignalDifference(*origin, samples=len(a), scale=scale)
    with np.errstate(invalid='ignore'):
        distance = np.where(same, 0.0, np.abs(b - a))
    bound, numbers = tolerance.bound(scale), ~(unknown_a | unknown_b)
    # Without a tolerance even the sign of a zero counts.
    differing = np.flatnonzero(~same & (~numbers | ~(distance <= bound) | (bound == 0.0)))
    distances = distance[numbers]
    unlike = (numbers & ~same).any()
    return SignalDifference(
        *origin,
        samples=len(a),
        differing=len(differing),
        exact=False,
        unknown_in_one=int(np.count_nonzero(unknown_a != unknown_b)),
        first=column.at(int(differing[0])) if len(differing) else None,
        largest=column.at(int(np.flatnonzero(numbers)[np.argmax(distances)])) if unlike else None,
        rms=math.sqrt(mean(distances * distances)) if len(distances) else math.nan,
        scale=scale,
    )


def by_importance(signals: Iterable[SignalDifference]) -> list[SignalDifference]:
    """Return the differing ones among `signals`, the most important first."""
    return sorted((signal for signal in signals if signal.differing), key=SignalDifference.importance)


def signal_sentences(signals: Iterable[SignalDifference]) -> list[str]:
    """Return the sentences about the most important of the differing `signals`."""
    ordered = by_importance(signals)
    others = [signal.name for signal in ordered[SHOWN:]]
    more = [f'{len(others)} more signals differ: {few(others)}'] if others else []
    return [*(signal.sentence for signal in ordered[:SHOWN]), *more]


def signal_table(signals: Iterable[SignalDifference]) -> Table:
    """Return the most important of the differing signals as a table."""
    ordered = by_importance(signals)
    more = len(ordered) - _ROWS
    return Table(
        'The largest differences',
        'lrrrrr',
        [signal.row() for signal in ordered[:_ROWS]],
        ('signal', 'samples', 'first (s)', 'largest', 'at (s)', 'rms'),
        f'{more} more differ; see --json' if more > 0 else '',
    )


def few(names: Sequence[str], separator: str = ', ', most: int = SHOWN) -> str:
    """Return the first names, and how many more there are."""
    more = f'{separator}{len(names) - most} more' if len(names) > most else ''
    return separator.join(names[:most]) + more


def known(value: float | None) -> float | None:
    """Return a number as JSON knows it: unknown is null."""
    return float(value) if value is not None and math.isfinite(value) else None


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
