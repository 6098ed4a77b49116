"""How a figure is spread over a fleet, before and after the change."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mount_report.drawing.chart import DASHED, Array, Chart, Curve, Panel
from mount_report.drawing.style import COLOURS
from mount_report.sections.section import Section, Table

if TYPE_CHECKING:
    import pyarrow

CHANGED = '_changed'
"""In the name of a column: the same figure with the change."""

_BINS = 30  # chosen
_QUANTILES = (('smallest', 0.0), ('median', 0.5), ('90 %', 0.9), ('99 %', 0.99), ('largest', 1.0))
_READABLE = {'m': (1e3, 'mm')}
"""{unit: factor and unit in which it is drawn}."""


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
    factor, unit = _READABLE.get(pair.unit, (1.0, pair.unit))
    before, after = factor * pair.before, factor * pair.after
    label = f'{pair.name} ({unit})' if unit else pair.name
    low, high = float(min(before.min(), after.min())), float(max(before.max(), after.max()))
    edges = _edges(low, high, pair.whole)
    panels = [
        Panel('rows', _curves(*_bars(before, edges), *_bars(after, edges))),
        Panel('share with at most this', _curves(*_shares(before, edges), *_shares(after, edges)), share=0.8),
    ]
    title = f'{pair.meaning[:1].upper()}{pair.meaning[1:]} ({pair.name})'
    chart = Chart(pair.name, title, label, panels, limits=(float(edges[0]), float(edges[-1])))
    rows = [
        (word, *(f'{np.quantile(values, share):.4g}' for values in (before, after)))
        for word, share in _QUANTILES
    ]
    table = Table((unit or 'value', 'as recorded', 'changed'), rows, title='Quantiles', folded=True)
    words = [f'{np.count_nonzero(before != after)} of {len(before)} rows have another value.']
    return Section(pair.name, title, words, chart, [table])


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
    return edges, np.append(counts, counts[-1])


def _shares(values: Array, edges: Array) -> tuple[Array, Array]:
    known = np.sort(values)
    shares = np.arange(len(known) + 1) / len(known)
    return np.concatenate([edges[:1], known, edges[-1:]]), np.append(shares, 1.0)


def _edges(low: float, high: float, whole: bool) -> Array:
    """Return the limits of the bins; of what is counted, each bin holds so many whole numbers."""
    if whole or high == low:
        step = max(1.0, np.ceil((high - low) / _BINS))
        return np.arange(low - 0.5, high + 0.5 + step, step)
    return np.linspace(low, high, _BINS + 1)
