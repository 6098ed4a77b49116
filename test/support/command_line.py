"""The `engine-mount` command in this process, as a user runs it: exit code, and all that it printed."""

import contextlib
import io
from collections.abc import Iterator

import pytest
from typer.main import get_command

from engine_mount.cli.command import app, main


def command(*words, codes=(0,)) -> str:
    """Run the command, which must end with one of `codes`; return what it printed."""
    printed = io.StringIO()
    with (
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(printed),
        pytest.raises(SystemExit) as ended,
    ):
        main([str(word) for word in words])
    assert ended.value.code in codes, printed.getvalue()
    return printed.getvalue()


def commands(group=None, prefix='') -> Iterator[str]:
    """Yield the words of every command."""
    for name, each in (group or get_command(app)).commands.items():
        if hasattr(each, 'commands'):
            yield from commands(each, f'{prefix}{name} ')
        else:
            yield prefix + name


def refused(*words, codes=(1, 2)) -> str:
    """Run the command, which must refuse; return its sentence in one line."""
    return ' '.join(command(*words, codes=codes).replace('│', ' ').split())
