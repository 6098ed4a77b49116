"""Wrong use of every command: exit code and one sentence that holds what was given, and nothing is done."""

import pytest
from command_line import command, commands, refused

MISSING = 'nowhere [/x]'
DRIVE = ('--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')
REFUSED = {
    'accept': (MISSING, '--reference', 'x', '--reason', 'y', '--folder', MISSING),
    'audit': (MISSING,),
    'bench': ('--only', MISSING),
    'calibrate actuator': (MISSING, '--name', 'x'),
    'calibrate inductance': (MISSING, '--name', 'x'),
    'check': ('--suite', MISSING),
    'compare': (MISSING, MISSING),
    'cut': (MISSING, '--from', '1s', '--to', '2s', '--out', MISSING),
    'drive': ('--core', '--scenario', 'recorded', '--file', MISSING),
    'experiment': (MISSING,),
    'faults': ('--only', MISSING),
    'fleet index': (MISSING, '--out', 'made'),
    'fleet query': (MISSING, 'select 1'),
    'fleet replay': (MISSING, '--set', 'continuous_viscous.damping_coefficient=1000', '--out', 'made'),
    'fleet report': (MISSING,),
    'fleet worst': (MISSING, '--by', 'duration_s'),
    'identify friction': ('--train', MISSING),
    'import': (MISSING, '--out', 'made'),
    'info': (MISSING,),
    'ls': (MISSING,),
    'recover': (MISSING,),
    'record': ('--split', MISSING),
    'replay': (MISSING,),
    'report': (MISSING,),
    'export c': ('--parameters', MISSING, '--out', 'law'),
    'road invert': (MISSING, '--column', 'az:m/s^2', '--speed', '20', '--out', 'made.csv'),
    'road show': (MISSING,),
    'view': (MISSING,),
}
TAKES_NOTHING_THAT_CAN_BE_MISSING = {'calibrate rack', 'fleet example', 'prepare', 'status'}


def test_every_command_is_in_the_table():
    assert set(commands()) == REFUSED.keys() | TAKES_NOTHING_THAT_CAN_BE_MISSING


@pytest.mark.parametrize('name', REFUSED)
def test_what_is_not_there_is_named_as_it_was_given(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert MISSING in refused(*name.split(), *REFUSED[name])


@pytest.mark.parametrize(
    ('words', 'sentence'),
    [
        ('drive --core --lockstep', 'choose --lockstep or --core, not both'),
        ('drive --core --scale 2', '--scale is for a recording: name it with --file FILE'),
        ('drive --core --speed 20', '--speed is for a road: name it with --road FILE'),
        ('drive --core --road a --file b', 'leave out --file'),
        ('drive --core --road a', '--road needs a speed'),
        ('drive --core --road a --speed 20 --column b --column c', '--column is given once for a road'),
        ('fleet replay a --out b', 'say what is to be other than recorded: --set NAME=VALUE'),
        ('fleet query a b --csv --json', 'choose --csv or --json, not both'),
        ('cut a', 'give --from and --to (or one of them), or --event'),
        ('cut a --from 1s --event 1', 'give --from and --to (or one of them), or --event'),
        ('record --duration 0', '--duration (0 s) must be above 0'),
        ('road invert a --speed 20 --out b', '--column NAME:UNIT, as in --column az:m/s^2'),
        ('experiment', '--list tells which there are'),
        ('accept a --reference b', "Missing option '--reason'"),
        ('compare a', "Missing argument 'B'"),
    ],
)
def test_wrong_use_ends_with_2_and_a_remedy(words, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert sentence in refused(*words.split(), codes=(2,))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('name', ['drive', 'replay nowhere', 'experiment sweep'])
@pytest.mark.parametrize('value', ['[x', '{', '"', '2026-99-99', '@x', 'a: b: c'])
def test_a_value_that_yaml_cannot_read_is_a_wrong_use_with_a_remedy(name, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    printed = refused(*name.split(), '--set', f'mount_control.damper={value}', codes=(2,))
    assert f"the value '{value}' is " in printed
    assert printed.count('put it in quotes') == 1
    assert not list(tmp_path.iterdir())


def test_a_folder_whose_name_is_markup_is_printed_as_it_is_called(tmp_path):
    folder = tmp_path / 'run [' / 'x] [mm]'
    folder.parent.mkdir()
    command('drive', *DRIVE, '--out', folder)
    for words in (
        ('cut', folder, '--from', '0.5s', '--to', '1s', '--out', f'{folder}_cut'),
        ('recover', folder / 'recording', '--out', f'{folder}_recovered'),
        ('replay', folder, '--out', f'{folder}_replayed'),
        ('report', folder, '--out', f'{folder}.html'),
        ('calibrate', 'rack', '--out', f'{folder}_rack'),
    ):
        assert 'run [/x] [mm]' in command(*words)
    file = tmp_path / 'a [g].csv'
    file.write_text('Zeit [s],Weg [mm]\n0.0,1.5\n1.0,2.5\n')
    printed = refused('drive', '--core', '--file', file, '--column', 'az [/g]')
    assert all(name in printed for name in ('a [g].csv', 'az [/g]', 'Weg [mm]'))
