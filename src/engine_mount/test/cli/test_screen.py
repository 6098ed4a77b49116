"""Bars and lines on a terminal, and what stands for them without one."""

import contextlib
import io

from engine_mount.cli import screen as of_screen
from engine_mount.cli.screen import TerminalScreen
from engine_mount.cli.terminal import terminal


def shown(file: io.StringIO) -> str:
    """Return the last frame of a bar."""
    return file.getvalue().replace('\x1b', '\n').replace('\r', '\n')


def test_a_bar_on_a_terminal_begins_at_0_and_is_full_at_the_end():
    file = io.StringIO()
    screen = TerminalScreen(terminal(file=file, force_terminal=True, width=80, color_system=None))
    with screen.bar('driving') as show:
        assert '  0%' in shown(file)
        show(0.97, detail='damping on')
    text = shown(file)
    assert text.rindex('100%') > text.rindex('driving')
    assert all(len(line) <= 80 for line in text.splitlines())


def test_a_bar_of_work_that_failed_stays_where_it_was():
    file = io.StringIO()
    screen = TerminalScreen(terminal(file=file, force_terminal=True, width=80, color_system=None))
    with contextlib.suppress(KeyboardInterrupt), screen.bar('driving') as show:
        show(0.97)
        raise KeyboardInterrupt
    assert ' 97%' in shown(file)
    assert '100%' not in shown(file)


def test_without_a_terminal_a_bar_is_a_plain_line_now_and_then(monkeypatch):
    file = io.StringIO()
    screen = TerminalScreen(terminal(file=file))
    with screen.bar('driving') as show:
        show(0.2)
        assert file.getvalue() == ''
        monkeypatch.setattr(of_screen, '_PLAIN_PERIOD', 0.0)
        show(0.4, detail='damping on')
    assert file.getvalue() == 'driving: 40 %, damping on\n'
    with screen.bar('reading', transient=True) as show:
        show(0.5)
    assert file.getvalue().count('\n') == 1
