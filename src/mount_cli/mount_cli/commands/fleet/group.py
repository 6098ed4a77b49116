"""`engine-mount fleet`: the group and its sub-commands."""

from collections.abc import Callable

import typer

from mount_cli.commands.fleet import example
from mount_cli.help import Command, Group

app = typer.Typer(
    cls=Group,
    name='fleet',
    help='Many recordings: catalogue, what if, questions.',
    no_args_is_help=True,
    rich_markup_mode='markdown',
)

_COMMANDS: tuple[tuple[str, Callable[..., None], str], ...] = (('example', example.example, example.EPILOG),)
"""Name, function and epilog of each sub-command."""


@app.callback()
def _top() -> None:
    """Keep sub-commands even while there is only one."""


for _name, _function, _epilog in _COMMANDS:
    app.command(name=_name, cls=Command, epilog=_epilog)(_function)
