"""How text gets to the terminal: as it stands, for a bracket in a path is no markup."""

from typing import Any

from rich.console import Console
from rich.text import Text


def terminal(**options: Any) -> Console:
    """Return the console of a command; `options` are those of Rich. Nothing that it prints is markup."""
    return Console(markup=False, emoji=False, highlight=False, **options)


def refuse(reason: object) -> None:
    """Print to standard error why a command does not do what was asked, in one line."""
    console = terminal(stderr=True)
    console.print(Text.assemble(('engine-mount:', 'red'), f' {reason}'), soft_wrap=True)
