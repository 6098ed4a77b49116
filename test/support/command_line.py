"""The `engine-mount` command in this process, as a user runs it: exit code, and all that it printed."""

import contextlib
import io

import pytest

from engine_mount.cli.command import main


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


def refused(*words, codes=(1, 2)) -> str:
    """Run the command, which must refuse; return its sentence in one line."""
    return ' '.join(command(*words, codes=codes).replace('│', ' ').split())
