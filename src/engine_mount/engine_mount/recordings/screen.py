"""What a program shows a person: lines, notes, tables, progress. Here as plain text; the desk draws it."""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import zip_longest
from typing import NamedTuple, TextIO


class Table(NamedTuple):
    """Rows of texts below `heads` (none: no head); `columns` has `l` or `r` for each: where its texts stand.

    The rows `marked` are not as they should be; `ruled`: rows of long texts, with lines between them.
    """

    title: str
    columns: str
    rows: Sequence[Sequence[str]]
    heads: Sequence[str] = ()
    caption: str = ''
    marked: frozenset[int] = frozenset()
    ruled: bool = False


Bar = Callable[..., None]
"""Takes the share that is done (0..1) and, where it has changed, `what` is being done.

`detail` is a sentence about this moment.
"""
Line = Callable[[str], None]
"""Takes the text that stands there from now on."""


class Screen:
    """Plain text in `file`, standard output unless it is given; bars and changing lines are left out."""

    def __init__(self, file: TextIO | None = None):
        self._file = file

    def say(self, text: str) -> None:
        """Show a text as it stands."""
        print(text, file=self._file or sys.stdout)

    def note(self, sentence: str, word: str = 'note') -> None:
        """Show a sentence that should not be overlooked, in one line."""
        self.say(f'{word} {sentence}')

    def table(self, table: Table) -> None:
        """Show a table."""
        rows = [*([table.heads] if table.heads else []), *table.rows]
        lines = [line for row in rows for line in zip_longest(*map(str.splitlines, row), fillvalue='')]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        self.say(table.title)
        for line in lines:
            cells = zip(line, widths, table.columns, strict=True)
            padded = [text.rjust(width) if to == 'r' else text.ljust(width) for text, width, to in cells]
            self.say('  '.join(padded).rstrip())
        if table.caption:
            self.say(table.caption)

    @contextlib.contextmanager
    def bar(self, what: str, *, transient: bool = False) -> Iterator[Bar]:
        """Show how far work has come while the context lasts; a `transient` bar is gone afterwards."""
        yield lambda share, what='', detail='': None

    @contextlib.contextmanager
    def line(self, text: str) -> Iterator[Line]:
        """Show a line that changes while the context lasts and is gone afterwards."""
        yield lambda text: None
