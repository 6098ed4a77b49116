"""How a figure is spread over a fleet, before and after the change."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.reports.drawing.chart import COLOURS, DASHED, Array, Chart, Curve, Panel
from engine_mount.reports.fleet.looks import handy_unit
from engine_mount.reports.sections.section import Section

if TYPE_CHECKING:
    import pyarrow

_OF_ONE_SIDE = re.compile(r',?( simulated)? as recorded( \(--closed-loop\))?')
"""What the meaning of a column says that stands for both sides here."""
_MOST_BINS = 30  # chosen


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
    """Return the figures that a result has before and after the change, where both are known.

    With the change `peak_a` is `peak_changed_a`, and `count` is `count_changed`.
    """
    found = []
    for field in result.schema:
        stem, _, unit = field.name.rpartition('_')
        for changed in {f'{stem}_changed_{unit}', f'{field.name}_changed'} & {*result.column_names}:
            columns = (result[name].to_pylist() for name in (field.name, changed))
            before, after = (np.array(column, np.float64) for column in columns)  # null becomes NaN
            known = np.isfinite(before) & np.isfinite(after)
            unit, meaning = (field.metadata[key].decode() for key in (b'unit', b'meaning'))
            if known.any():
                counts = str(field.type) == 'int64'
                found.append(Pair(field.name, unit, meaning, before[known], after[known], counts))
    return found


def spread(pair: Pair) -> Section:
    """Return the section about one figure: how many rows have which value, and quantiles."""
    factor, unit = handy_unit(pair.unit, [*pair.before, *pair.after])
    both = factor * pair.before, factor * pair.after
    stem, _, suffix = pair.name.rpartition('_')
    title = (stem if suffix == pair.unit.lower() else pair.name).replace('_', ' ')
    behind = f' ({unit})' if unit else ''
    edges = _edges(np.concatenate(both), len(pair.before), pair.whole)
    looks = (('as recorded', COLOURS[0], 'solid'), ('changed', COLOURS[1], DASHED))
    curves = []
    for (name, colour, dash), values in zip(looks, both, strict=True):
        counts = np.histogram(values, edges)[0].astype(np.float64)
        curves.append(Curve(name, np.repeat(edges, 2)[1:-1], np.repeat(counts, 2), colour, dash))
    panels, limits = [Panel('number of rows', curves, least=[0.0])], (edges[0], edges[-1])
    chart = Chart(pair.name, _capital(title), f'{title}{behind}', panels, limits=limits)
    moved = np.count_nonzero(both[0] != both[1])
    words = [
        f'{_capital(_OF_ONE_SIDE.sub("", pair.meaning))}, in the column {pair.name}. '
        f'{moved} of {len(pair.before)} rows have another value with the change.'
    ]
    return Section(pair.name, _capital(title), words, chart, half=True)


def _capital(text: str) -> str:
    return f'{text[:1].upper()}{text[1:]}'


def _edges(values: Array, count: int, whole: bool) -> Array:
    """Return the limits of the bins; of what is counted, each bin holds so many whole numbers.

    Of `count` rows 2 count^(1/3) bins (Rice's rule), so that few values make no comb.
    """
    low, high = values.min(), values.max()
    bins = min(_MOST_BINS, max(1, round(2.0 * np.cbrt(count))))
    if whole or high == low:
        step = max(1.0, np.ceil((high - low) / bins))
        return np.arange(low - 0.5, high + 0.5 + step, step)
    return np.linspace(low, high, bins + 1)
