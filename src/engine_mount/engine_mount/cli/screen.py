"""Tables, bars and changing lines in the terminal."""

import contextlib
import time
from collections.abc import Callable, Iterator

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import (
    BarColumn,
    Progress,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table as RichTable
from rich.text import Text

from engine_mount.cli.terminal import note
from engine_mount.recordings.screen import Bar, Line, Screen, Table

_PLAIN_PERIOD = 10.0  # s, chosen


def progress_bar(console: Console, *, transient: bool = False) -> Progress:
    """Return the bar; a `transient` one is gone when the work is done."""
    what = TextColumn('{task.description}', markup=False)
    columns = (what, BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), _TimeLeft(compact=True))
    return Progress(*columns, console=console, transient=transient)


class _TimeLeft(TimeRemainingColumn):
    """The time left, while there is any."""

    def render(self, task: Task) -> Text:
        left = super().render(task)
        return Text() if task.finished or task.total is None else Text(f'{left} left', left.style)


class _Below:
    """A bar, and below it a line that ends where the terminal does; none without words."""

    def __init__(self, bar: Progress, text: Text):
        text.no_wrap, text.overflow = True, 'ellipsis'
        self._bar, self._text = bar, text

    def __rich__(self) -> RenderableType:
        return Group(self._bar, self._text) if self._text.plain else self._bar


class _PlainBar:
    """A bar without a terminal: one line each time that so many seconds have passed."""

    def __init__(self, what: str, say: Callable[[str], None], clock: Callable[[], float] = time.monotonic):
        self._what = what
        self._say = say
        self._clock = clock
        self._told = clock()

    def __call__(self, share: float, what: str = '', detail: str = '') -> None:
        self._what = what or self._what
        if self._clock() - self._told >= _PLAIN_PERIOD:
            self._told = self._clock()
            self._say(f'{self._what}: {100 * share:.0f} %' + (f', {detail}' if detail else ''))


def _say_nothing(text: str) -> None:
    pass


class TerminalScreen(Screen):
    """Draws on the console of a command."""

    def __init__(self, console: Console):
        super().__init__()
        self._console = console

    def say(self, text: str) -> None:
        """Print a text, which the terminal wraps."""
        self._console.print(text, soft_wrap=True)

    def note(self, sentence: str, word: str = 'note') -> None:
        """Print a sentence with its word in colour."""
        note(self._console, sentence, word)

    def table(self, table: Table) -> None:
        """Draw a table as wide as its texts; long ones on the left are folded."""
        drawn = RichTable(title=table.title, title_justify='left', caption=table.caption or None)
        drawn.box, drawn.pad_edge, drawn.show_header = SIMPLE_HEAD, False, bool(table.heads)
        drawn.padding = (0, 1, 0, 0)  # narrow, so that tables fit 80 columns
        drawn.caption_justify, drawn.show_lines = 'left', table.ruled
        for place, to in enumerate(table.columns):
            head = table.heads[place] if table.heads else ''
            if to == 'r':
                drawn.add_column(head, justify='right', no_wrap=True)
            else:
                drawn.add_column(head, overflow='fold')
        for place, row in enumerate(table.rows):
            drawn.add_row(*row, style='yellow' if place in table.marked else None)
        self._console.print(drawn)

    @contextlib.contextmanager
    def bar(self, what: str, *, transient: bool = False) -> Iterator[Bar]:
        """Draw a bar with share, times passed and left, and a line of details below; full at the end.

        Without a terminal: a line now and then, none of a `transient` one.
        """
        if not self._console.is_terminal:
            yield _PlainBar(what, self.say if not transient else _say_nothing)
            return
        progress, below = progress_bar(self._console), Text()
        task = progress.add_task(what, total=1.0)

        def show(share: float, what: str = '', detail: str = '') -> None:
            progress.update(task, completed=share, description=what or None)
            below.plain = detail

        live = Live(_Below(progress, below), console=self._console, transient=transient)
        with live:
            yield show
            show(1.0)

    @contextlib.contextmanager
    def line(self, text: str) -> Iterator[Line]:
        """Draw the line in its place, cut off where the terminal ends."""
        live = Live(console=self._console, auto_refresh=False, transient=True, redirect_stderr=False)
        with live:

            def show(text: str) -> None:
                live.update(Text(text, no_wrap=True, overflow='ellipsis'), refresh=True)

            show(text)
            yield show
