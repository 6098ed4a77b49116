"""The bar that shows how far long work has come."""

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn


def progress_bar(console: Console, *, transient: bool = False) -> Progress:
    """Return the bar; a `transient` one is gone when the work is done."""
    what = TextColumn('{task.description}', markup=False)
    columns = (what, BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, transient=transient)
