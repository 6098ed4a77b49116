"""How a figure is spread over a fleet, before and after the change."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.reports.drawing.chart import DASHED, Array, Chart, Curve, Panel
from engine_mount.reports.drawing.style import COLOURS
from engine_mount.reports.fleet.readable import handy_unit, number
from engine_mount.reports.sections.section import Section, Table

if TYPE_CHECKING:
    import pyarrow

CHANGED = '_changed'
"""In the name of a column: the same figure with the change."""

_MOST_BINS = 30  # chosen
_QUANTILES = (('smallest', 0.0), ('median', 0.5), ('90 %', 0.9), ('99 %', 0.99), ('largest', 1.0))
_OF_ONE_SIDE = re.compile(r',?( simulated)? as recorded( \(--closed-loop\))?')
"""What the meaning of a column says that stands for both sides here."""


@dataclass(frozen=True)
class Pair:
    """A figure of each row before and after the change, (n,), in the unit of the columns."""

    name: str
    unit: str
    meaning: str
    before: Array
    after: Array
    whole: bool = False  # it counts something

    @property
    def title(self) -> str:
        """Its name in words, without its unit."""
        stem, _, unit = self.name.rpartition('_')
        return (stem if unit == self.unit.lower() else self.name).replace('_', ' ')

    @property
    def told(self) -> str:
        """What it means, of both sides."""
        return _OF_ONE_SIDE.sub('', self.meaning)

    @property
    def moved(self) -> bool:
        """Whether the change moved it anywhere."""
        return not np.array_equal(self.before, self.after)


def pairs_of(result: 'pyarrow.Table') -> list[Pair]:
    """Return the figures that a result has before and after the change, where both are known."""
    found = []
    for name in result.column_names:
        changed = _changed_name(name, result.column_names)
        if changed is None:
            continue
        field = result.schema.field(name)
        both = [
            np.array(result.column(each).to_pylist(), dtype=np.float64)  # null becomes NaN
            for each in (name, changed)
        ]
        known = np.isfinite(both[0]) & np.isfinite(both[1])
        if known.any():
            told = {key.decode(): text.decode() for key, text in (field.metadata or {}).items()}
            before, after = both[0][known], both[1][known]
            unit, meaning = told.get('unit', ''), told.get('meaning', name)
            found.append(Pair(name, unit, meaning, before, after, str(field.type) == 'int64'))
    return found


def spread(pair: Pair) -> Section:
    """Return the section about one figure: how many rows have which value, and quantiles."""
    factor, unit = handy_unit(pair.unit, [*pair.before, *pair.after])
    before, after = factor * pair.before, factor * pair.after
    label = f'{pair.title} ({unit})' if unit else pair.title
    low, high = float(min(before.min(), after.min())), float(max(before.max(), after.max()))
    edges = _edges(low, high, len(before), pair.whole)
    panels = [
        Panel('number of rows', _curves(*_bars(before, edges), *_bars(after, edges))),
        Panel(
            'share of rows at or below', _curves(*_shares(before, edges), *_shares(after, edges)), share=0.8
        ),
    ]
    title = f'{pair.title[:1].upper()}{pair.title[1:]}'
    chart = Chart(pair.name, title, label, panels, limits=(float(edges[0]), float(edges[-1])))
    rows = [
        (word, *(_told(float(np.quantile(values, share)), pair.whole) for values in (before, after)))
        for word, share in _QUANTILES
    ]
    head = (f'value ({unit})' if unit else 'value', 'as recorded', 'changed')
    moved = int(np.count_nonzero(before != after))
    words = [
        f'{pair.told[:1].upper()}{pair.told[1:]}, in the column {pair.name}. '
        f'{moved} of {len(before)} rows have another value with the change.'
    ]
    table = Table(head, rows, title='Quantiles', folded=True)
    return Section(pair.name, title, words, chart, [table], half=True)


def _told(value: float, whole: bool) -> str:
    return f'{value:g}' if whole else number(value)


def _changed_name(name: str, names: Sequence[str]) -> str | None:
    """Return the column of the same figure with the change: `peak_a` and `peak_changed_a`."""
    stem, _, unit = name.rpartition('_')
    wanted = (f'{stem}{CHANGED}_{unit}', f'{name}{CHANGED}')
    return next((each for each in wanted if each in names), None)


def _curves(before_x: Array, before_y: Array, after_x: Array, after_y: Array) -> list[Curve]:
    return [
        Curve('as recorded', before_x, before_y, COLOURS[0], steps=True, width=1.6),
        Curve('changed', after_x, after_y, COLOURS[1], DASHED, steps=True, width=1.6),
    ]


def _bars(values: Array, edges: Array) -> tuple[Array, Array]:
    counts = np.histogram(values, edges)[0].astype(np.float64)
    return edges, np.append(counts, 0.0)


def _shares(values: Array, edges: Array) -> tuple[Array, Array]:
    known = np.sort(values)
    shares = np.arange(len(known) + 1) / len(known)
    return np.concatenate([edges[:1], known, edges[-1:]]), np.append(shares, 1.0)


def _edges(low: float, high: float, count: int, whole: bool) -> Array:
    """Return the limits of the bins; of what is counted, each bin holds so many whole numbers.

    Of `count` values 2 count^(1/3) bins (Rice's rule), so that few values make no comb.
    """
    bins = min(_MOST_BINS, max(1, round(2.0 * np.cbrt(count))))
    if whole or high == low:
        step = max(1.0, np.ceil((high - low) / bins))
        return np.arange(low - 0.5, high + 0.5 + step, step)
    return np.linspace(low, high, bins + 1)
