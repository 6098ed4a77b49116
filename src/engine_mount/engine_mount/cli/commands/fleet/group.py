"""`engine-mount fleet`: the group and its sub-commands."""

from collections.abc import Callable

from engine_mount.cli.commands.fleet import asking, making
from engine_mount.cli.help import Command, group

app = group('fleet', 'Many recordings: catalogue, what if, questions.')

_COMMANDS: tuple[tuple[Callable[..., None], str], ...] = (
    (making.index, making.INDEX_EPILOG),
    (making.replay, making.REPLAY_EPILOG),
    (asking.query, asking.QUERY_EPILOG),
    (asking.worst, asking.WORST_EPILOG),
    (asking.report, asking.REPORT_EPILOG),
    (making.example, making.EXAMPLE_EPILOG),
)
"""Function and epilog of each sub-command."""

for _function, _epilog in _COMMANDS:
    app.command(cls=Command, epilog=_epilog)(_function)
