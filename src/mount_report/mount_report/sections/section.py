"""What a page is made of: sections with words, tables and a chart."""

from collections.abc import Sequence
from dataclasses import dataclass

from mount_report.drawing.chart import Chart


@dataclass(frozen=True)
class Table:
    """Rows of text under a head; the first column names the row. `marked` are rows to be seen first."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ''
    marked: frozenset[int] = frozenset()
    folded: bool = False  # shown on demand; printed in full


@dataclass(frozen=True)
class Section:
    """A part of the page: sentences, a chart, tables, in this order. `name` is that of its anchor."""

    name: str
    title: str
    words: Sequence[str] = ()
    chart: Chart | None = None
    tables: Sequence[Table] = ()
