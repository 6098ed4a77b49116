"""What the tests of this package share: small pictures, and the command as a user runs it."""

import contextlib
import io

import pytest

from engine_mount.cli.command import main
from engine_mount.experiments.harness import drawing


@pytest.fixture(autouse=True, scope='session')
def small_pictures():
    """Draw the experiments' pictures small and without a search for their layout, a third of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, '_DPI', 20)
        patch.setattr(drawing, '_LAYOUT', None)
        yield


@pytest.fixture(scope='session')
def command():
    """Return what runs the command and returns all that it printed; `codes`: how it may end."""

    def command(*words, codes=(0,)):
        printed = io.StringIO()
        with (
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(printed),
            pytest.raises(SystemExit) as ended,
        ):
            main([str(word) for word in words])
        assert ended.value.code in codes, printed.getvalue()
        return printed.getvalue()

    return command


@pytest.fixture(scope='session')
def refused(command):
    """Return what runs the command, which must refuse, and returns its sentence in one line."""

    def refused(*words, codes=(1, 2)):
        return ' '.join(command(*words, codes=codes).replace('│', ' ').split())

    return refused
