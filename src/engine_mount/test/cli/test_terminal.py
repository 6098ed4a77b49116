"""What the command prints is text as it stands, whatever brackets a path or the name of a column holds."""

import contextlib
import io
from pathlib import Path

import pytest

import engine_mount.cli
from engine_mount.cli.command import app, main
from engine_mount.cli.screen import TerminalScreen
from engine_mount.cli.terminal import refuse, terminal
from engine_mount.recordings.screen import Table

SOURCES = Path(engine_mount.cli.__file__).parents[3]
TEXT = 'a [/g] of [red]Weg [mm][/red]: {"columns": ["time", "[/x]"]} :smile:'
MISSING = 'nowhere [/x]'
DRIVE = ('--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')


def run(capsys, *arguments) -> tuple[int, str]:
    """Return exit code and all that the command printed, long lines of the usage panel joined."""
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    printed = capsys.readouterr()
    return end.value.code, printed.out + ' '.join(printed.err.replace('│', ' ').split())


@pytest.fixture(scope='module')
def drive(tmp_path_factory) -> Path:
    """Return the folder of a short drive whose name is markup."""
    folder = tmp_path_factory.mktemp('drives') / 'run [' / 'x] [mm]'
    folder.parent.mkdir()
    with pytest.raises(SystemExit) as end:
        main(['drive', *DRIVE, '--out', str(folder)])
    assert end.value.code == 0
    return folder


def test_nothing_that_is_printed_is_markup(capsys):
    file = io.StringIO()
    console = terminal(file=file, width=200)
    screen = TerminalScreen(console)
    screen.table(Table(TEXT, 'l', [[TEXT]], [TEXT], TEXT))
    screen.say(TEXT)
    screen.note(TEXT)
    assert file.getvalue().count(TEXT) == 6
    assert file.getvalue().count(f'note {TEXT}\n') == 1
    drawn = io.StringIO()
    screen = TerminalScreen(terminal(file=drawn, width=200, force_terminal=True, color_system=None))
    with contextlib.suppress(KeyboardInterrupt), screen.bar(TEXT) as show:
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


REFUSED = {
    'accept': (MISSING, '--reference', 'x', '--reason', 'y', '--folder', MISSING),
    'audit': (MISSING,),
    'calibrate actuator': (MISSING, '--name', 'x'),
    'calibrate inductance': (MISSING, '--name', 'x'),
    'check': ('--suite', MISSING),
    'compare': (MISSING, MISSING),
    'cut': (MISSING, '--from', '1s', '--to', '2s', '--out', MISSING),
    'drive': ('--core', '--scenario', 'recorded', '--file', MISSING),
    'fleet index': (MISSING, '--out', 'made'),
    'fleet query': (MISSING, 'select 1'),
    'fleet replay': (MISSING, '--set', 'continuous_viscous.damping_coefficient=1000', '--out', 'made'),
    'fleet report': (MISSING,),
    'fleet worst': (MISSING, '--by', 'duration_s'),
    'import': (MISSING, '--out', 'made'),
    'info': (MISSING,),
    'ls': (MISSING,),
    'identify friction': ('--train', MISSING),
    'merge': (MISSING, '--out', MISSING),
    'recover': (MISSING,),
    'replay': (MISSING,),
    'report': (MISSING,),
    'road invert': (MISSING, '--column', 'az:m/s^2', '--speed', '20', '--out', 'made.csv'),
    'road show': (MISSING,),
    'view': (MISSING,),
}
WITHOUT_A_FILE = {
    'bench': (),
    'prepare': (),
    'calibrate rack': (),
    'experiment': ('[/x]',),
    'fleet example': (),
    'record': ('--split', '[/x]'),
    'faults': ('--only', '[/x]'),
    'status': (),
}


def test_every_command_is_walked():
    from typer.main import get_command

    def leaves(group, prefix=''):
        for name, command in group.commands.items():
            if hasattr(command, 'commands'):
                yield from leaves(command, f'{prefix}{name} ')
            else:
                yield prefix + name

    assert set(leaves(get_command(app))) == REFUSED.keys() | WITHOUT_A_FILE.keys()


@pytest.mark.parametrize('command', REFUSED)
def test_a_missing_path_is_named_as_it_was_given(command, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, printed = run(capsys, *command.split(), *REFUSED[command])
    assert code in (1, 2)
    assert MISSING in printed


@pytest.mark.parametrize('command', [name for name, arguments in WITHOUT_A_FILE.items() if arguments])
def test_a_word_in_brackets_is_refused_in_a_sentence_that_holds_it(command, capsys):
    code, printed = run(capsys, command, *WITHOUT_A_FILE[command])
    assert code in (1, 2)
    assert '[/x]' in printed


@pytest.mark.parametrize(
    'command', ['audit', 'compare', 'cut', 'merge', 'recover', 'replay', 'report', 'calibrate rack']
)
def test_a_folder_whose_name_is_markup_is_printed_as_it_is_called(command, drive, capsys, tmp_path):
    out = tmp_path / '[' / 'x]'
    out.parent.mkdir()
    arguments = {
        'audit': (drive / 'recording',),
        'compare': (drive, drive, '--figure', f'{out}.png'),
        'cut': (drive, '--from', '0.5s', '--to', '1s', '--out', out),
        'merge': (drive, '--out', out),
        'recover': (drive / 'recording', '--out', out),
        'replay': (drive, '--out', out),
        'report': (drive, '--out', f'{out}.html'),
        'calibrate rack': ('--out', out),
    }[command]
    code, printed = run(capsys, *command.split(), *arguments)
    assert code == 0, printed
    if command != 'audit':
        assert '[/x]' in printed


def test_a_column_with_its_unit_in_brackets_stays_in_the_refusal(capsys, tmp_path):
    file = tmp_path / 'a [' / 'g].csv'
    file.parent.mkdir()
    file.write_text('Zeit [s],Weg [mm]\n0.0,1.5\n1.0,2.5\n')
    code, printed = run(
        capsys, 'drive', '--core', '--scenario', 'recorded', '--file', file, '--column', 'az [/g]'
    )
    assert code == 1
    assert all(name in printed for name in ('a [/g].csv', 'az [/g]', 'Weg [mm]'))
    code, printed = run(capsys, 'calibrate', 'actuator', file, '--name', 'x', '--column', 'gap=Spalt [um]:um')
    assert 'Spalt [um]' in printed
    assert 'Weg [mm]' in printed


@pytest.mark.parametrize('command', ['drive', 'replay nowhere', 'experiment sweep'])
@pytest.mark.parametrize('value', ['[x', '{', '"', '2026-99-99', '@x', 'a: b: c'])
def test_a_value_that_yaml_cannot_read_is_a_wrong_use_with_a_remedy(
    command, value, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, printed = run(capsys, *command.split(), '--set', f'mount_control.damper={value}')
    assert code == 2
    assert f"the value '{value}' is " in printed
    assert printed.count('put it in quotes') == 1
    assert not list(tmp_path.iterdir())
