"""`engine-mount fleet`: the group and its sub-commands."""

from collections.abc import Callable

import typer

from engine_mount.cli.commands.fleet import example, index, query, replay, report, worst
from engine_mount.cli.help import Command, Group

app = typer.Typer(
    cls=Group,
    name='fleet',
    help='Many recordings: catalogue, what if, questions.',
    no_args_is_help=True,
    rich_markup_mode='markdown',
)

_COMMANDS: tuple[tuple[str, Callable[..., None], str], ...] = (
    ('index', index.index, index.EPILOG),
    ('replay', replay.replay, replay.EPILOG),
    ('query', query.query, query.EPILOG),
    ('worst', worst.worst, worst.EPILOG),
    ('report', report.report, report.EPILOG),
    ('example', example.example, example.EPILOG),
)
"""Name, function and epilog of each sub-command."""

for _name, _function, _epilog in _COMMANDS:
    app.command(name=_name, cls=Command, epilog=_epilog)(_function)
