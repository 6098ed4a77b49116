"""What a page is made of: sections with words, tables and a chart."""

from collections.abc import Sequence
from typing import NamedTuple

from engine_mount.recordings.difference import time_text
from engine_mount.reports.drawing.chart import Chart

GOOD, LOOK, BAD, UNKNOWN, NOT_APPLICABLE = 'good', 'have a look', 'bad', 'unknown', 'not applicable'
"""Judgements; their words are classes of the style."""


class Link(NamedTuple):
    """A text that leads to a section; where it has a chart, to the time `at` (s) in it."""

    text: str
    section: str
    at: float | None = None


Cell = str | Link


class Finding(NamedTuple):
    """One part of the verdict: what it is about, how it is judged, and the text in parts."""

    what: str
    judgement: str
    text: Sequence[Cell]


class Table(NamedTuple):
    """Rows of text under a head; the first column names the row. `marked` are rows to be seen first."""

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    title: str = ''
    marked: frozenset[int] = frozenset()
    folded: bool = False  # shown on demand; printed in full


class Section(NamedTuple):
    """A part of the page: findings, sentences, commands, a chart, tables, in this order.

    `name` is that of its anchor. Neighbours that are `half` stand side by side where the page is wide.
    """

    name: str
    title: str
    words: Sequence[str] = ()
    chart: Chart | None = None
    tables: Sequence[Table] = ()
    findings: Sequence[Finding] = ()
    commands: Sequence[str] = ()  # of the shell, shown as they are typed
    half: bool = False
    is_listed: bool = True  # at the top of the page


def moment(time: float) -> Link:
    """Return a time (s) that links to the traces there."""
    return Link(time_text(time), 'traces', time)
