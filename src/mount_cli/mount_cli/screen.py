"""Tables, bars and changing lines in the terminal."""

import contextlib
from collections.abc import Iterator

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable
from rich.text import Text

from mount_bags.run.screen import Bar, Line, Screen, Table
from mount_cli.terminal import note


def progress_bar(console: Console, *, transient: bool = False) -> Progress:
    """Return the bar; a `transient` one is gone when the work is done."""
    what = TextColumn('{task.description}', markup=False)
    columns = (what, BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, transient=transient)


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
        """Draw a bar with the share in per cent and the time that has passed."""
        with progress_bar(self._console, transient=transient) as progress:
            task = progress.add_task(what, total=1.0)

            def show(share: float, what: str = '') -> None:
                progress.update(task, completed=share, description=what or None)

            yield show

    @contextlib.contextmanager
    def line(self, text: str) -> Iterator[Line]:
        """Draw the line in its place, cut off where the terminal ends."""
        live = Live(console=self._console, auto_refresh=False, transient=True, redirect_stderr=False)
        with live:

            def show(text: str) -> None:
                live.update(Text(text, no_wrap=True, overflow='ellipsis'), refresh=True)

            show(text)
            yield show
