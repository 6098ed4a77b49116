"""Bars and lines on a terminal, what stands for them without one, and text that is never markup."""

import contextlib
import io
from pathlib import Path

import engine_mount.cli
from engine_mount.cli import screen as of_screen
from engine_mount.cli.screen import TerminalScreen
from engine_mount.cli.terminal import refuse, terminal
from engine_mount.recordings.screen import Table

SOURCES = Path(engine_mount.cli.__file__).parents[3]
TEXT = 'a [/g] of [red]Weg [mm][/red]: {"columns": ["time", "[/x]"]} :smile:'


def screen_on(file, width=80):
    return TerminalScreen(terminal(file=file, force_terminal=True, width=width, color_system=None))


def test_a_bar_begins_at_0_is_full_at_the_end_and_stays_where_work_failed():
    file = io.StringIO()
    with screen_on(file).bar('driving') as show:
        assert '  0%' in file.getvalue()
        show(0.97, detail='damping on')
    text = file.getvalue().replace('\x1b', '\n').replace('\r', '\n')
    assert text.rindex('100%') > text.rindex('driving')
    assert all(len(line) <= 80 for line in text.splitlines())
    file = io.StringIO()
    with contextlib.suppress(KeyboardInterrupt), screen_on(file).bar('driving') as show:
        show(0.97)
        raise KeyboardInterrupt
    assert ' 97%' in file.getvalue()
    assert '100%' not in file.getvalue()


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


def test_nothing_that_is_printed_is_markup(capsys):
    file = io.StringIO()
    screen = TerminalScreen(terminal(file=file, width=200))
    screen.table(Table(TEXT, 'l', [[TEXT]], [TEXT], TEXT))
    screen.say(TEXT)
    screen.note(TEXT)
    assert file.getvalue().count(TEXT) == 6
    drawn = io.StringIO()
    with contextlib.suppress(KeyboardInterrupt), screen_on(drawn, 200).bar(TEXT) as show:
        show(0.5, detail=f'detail {TEXT}')
        raise KeyboardInterrupt
    assert f'detail {TEXT}' in drawn.getvalue()
    assert drawn.getvalue().count(TEXT) > drawn.getvalue().count(f'detail {TEXT}')
    refuse(TEXT)
    assert capsys.readouterr().err == f'engine-mount: {TEXT}\n'


def test_only_one_file_decides_how_text_is_printed():
    """A console or bar made elsewhere would take brackets for markup again."""
    ways = ('Console(', ' Progress(', 'from_markup', '[yellow]', '[red]', '[bold]', ' rprint')
    found = {
        f'{file.relative_to(SOURCES)}: {way}'
        for file in SOURCES.glob('*/*mount*/**/*.py')
        for way in ways
        if way in file.read_text(encoding='utf-8')
    }
    own = 'engine_mount/engine_mount/cli'
    assert found == {f'{own}/terminal.py: Console(', f'{own}/screen.py:  Progress('}
