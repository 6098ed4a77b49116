"""Tables, bars and changing lines in the terminal."""

import contextlib
import time
from collections.abc import Iterator

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table as RichTable
from rich.text import Text

from engine_mount.cli.terminal import terminal
from engine_mount.recordings.screen import Bar, Line, Screen, Table

_PLAIN_PERIOD = 10.0  # s, chosen


class TerminalScreen(Screen):
    """Draws on the console of a command."""

    def __init__(self, console: Console | None = None):
        super().__init__()
        self.console = console or terminal()

    def say(self, text: str) -> None:
        """Print a text, which the terminal wraps."""
        self.console.print(text, soft_wrap=True)

    def note(self, sentence: str, word: str = 'note') -> None:
        """Print a sentence with its word in colour."""
        self.console.print(Text.assemble((word, 'yellow'), f' {sentence}'), soft_wrap=True)

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
        self.console.print(drawn)

    @contextlib.contextmanager
    def bar(self, what: str, *, transient: bool = False) -> Iterator[Bar]:
        """Draw a bar with share and time, and a line of details below; full at the end.

        Without a terminal: a line now and then, none of a `transient` one.
        """
        if not self.console.is_terminal:
            yield self._plain_bar(what, transient)
            return
        columns = (BarColumn(), TaskProgressColumn(), TimeRemainingColumn(elapsed_when_finished=True))
        progress = Progress(TextColumn('{task.description}', markup=False), *columns, console=self.console)
        task, below = progress.add_task(what, total=1.0), Text(no_wrap=True, overflow='ellipsis')

        def show(share: float, what: str = '', detail: str = '') -> None:
            progress.update(task, completed=share, description=what or None)
            below.plain = detail

        with Live(Group(progress, below), console=self.console, transient=transient):
            yield show
            show(1.0)

    def _plain_bar(self, what: str, silent: bool) -> Bar:
        """Return a bar that says a line each time that so many seconds have passed."""
        label, said = what, time.monotonic()

        def show(share: float, what: str = '', detail: str = '') -> None:
            nonlocal label, said
            label = what or label
            if not silent and time.monotonic() - said >= _PLAIN_PERIOD:
                said = time.monotonic()
                self.say(f'{label}: {100 * share:.0f} %' + (f', {detail}' if detail else ''))

        return show

    @contextlib.contextmanager
    def line(self, text: str) -> Iterator[Line]:
        """Draw the line in its place, cut off where the terminal ends."""
        with Live(console=self.console, auto_refresh=False, transient=True, redirect_stderr=False) as live:

            def show(text: str) -> None:
                live.update(Text(text, no_wrap=True, overflow='ellipsis'), refresh=True)

            show(text)
            yield show
