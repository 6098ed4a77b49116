"""Wrong use of every command: exit code and one sentence that holds what was given, and nothing is done."""

import pytest
from command_line import command, commands, refused

MISSING = 'nowhere [/x]'
DRIVE = ('--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8')
WRONG = {
    'audit ?': MISSING,
    'calibrate actuator ? --name x': MISSING,
    'calibrate inductance ? --name x': MISSING,
    'check --suite ?': MISSING,
    'compare ? ?': MISSING,
    'dev accept ? --reference x --reason y --folder ?': MISSING,
    'dev bench --only ?': MISSING,
    'dev faults --only ?': MISSING,
    'drive --core --scenario recorded --file ?': MISSING,
    'edit cut ? --from 1s --to 2s --out ?': MISSING,
    'edit recover ?': MISSING,
    'experiment ?': MISSING,
    'export c --parameters ? --out made': MISSING,
    'export signals ? --out made.csv': MISSING,
    'fleet index ? --out made': MISSING,
    'fleet query ? select': MISSING,
    'fleet replay ? --set continuous_viscous.damping_coefficient=1000 --out made': MISSING,
    'fleet report ?': MISSING,
    'fleet worst ? --by duration_s': MISSING,
    'identify friction --train ?': MISSING,
    'identify pads ?': MISSING,
    'import ? --out made': MISSING,
    'info ?': MISSING,
    'ls ?': MISSING,
    'record --split ?': MISSING,
    'replay ?': MISSING,
    'report ?': MISSING,
    'road invert ? --column az:m/s^2 --speed 20 --out made.csv': MISSING,
    'road show ?': MISSING,
    'view ?': MISSING,
    'check --only gap_20m': "'gap_20m' is no manoeuvre of the suite; did you mean gap_20mm",
    'check --set mount_control.polcy=x': 'did you mean policy',
    'check --set mount_sim.motorway.gap_depth=0': 'is set by the manoeuvre',
    'compare a': "Missing argument 'B'",
    'dev accept a --reference b': "Missing option '--reason'",
    'dev bench --only grap': "'grap' is no group of bench; did you mean graph?",
    'dev faults --only coil_opn': "'coil_opn' is no fault; did you mean coil_open",
    'drive --core --duration x': '--duration',
    'drive --core --fault coil_opn@3': "fault 'coil_opn' is unknown; did you mean coil_open",
    'drive --core --json nowhere/x.json': 'make nowhere first',
    'drive --core --lockstep': 'choose --lockstep or --core, not both',
    'drive --core --mount hidro': "mount 'hidro' is unknown; did you mean hydro?",
    'drive --core --mounts left,rite': "'rite' is no place",
    'drive --core --road a': '--road needs a speed',
    'drive --core --road a --file b': 'leave out --file',
    'drive --core --road a --speed 20 --column b --column c': '--column is given once for a road',
    'drive --core --sample-rate 100': '500',
    'drive --core --scale 2': '--scale is for a recording: name it with --file FILE',
    'drive --core --scenario motorwy': "scenario 'motorwy' is unknown; did you mean motorway?",
    'drive --core --set mount_control.policy=switched_viscos': 'did you mean switched_viscous',
    'drive --core --set qualty=1': 'did you mean',
    'drive --core --speed 20': '--speed is for a road: name it with --road FILE',
    'drive --lockstp': 'No such option: --lockstp; did you mean --lockstep?',
    'drve': "No such command 'drve'. Did you mean 'drive'?",
    'edit cut a': 'give --from and --to (or one of them), or --event',
    'edit cut a --from 1s --event 1': 'give --from and --to (or one of them), or --event',
    'experiment': '--list tells which there are',
    'experiment sweeep': "'sweeep' is no experiment; did you mean sweep?",
    'export signals ? --out made.xls': "'.xls'; known are .csv, .parquet, .mat",
    'fleet query a b --format xml': "'xml' is no format; known are table, csv, json",
    'fleet replay a --out b': 'say what is to be other than recorded: --set NAME=VALUE',
    'identify friction --train a --step ramps': "--step 'ramps' is unknown; did you mean ramp?",
    'record --duration 0': '--duration (0 s) must be above 0',
    'record --on-full stopp': 'stop',
    'record displacment': "'displacment' is no topic of the graph; did you mean displacement?",
    'road invert a --speed 20 --out b': '--column NAME:UNIT, as in --column az:m/s^2',
    'view a --playback-speed 0': '--playback-speed',
}
"""{words, ? for a name of what is not there: what the sentence holds}."""
TAKES_NOTHING_THAT_CAN_BE_MISSING = {'calibrate rack', 'dev prepare', 'fleet example', 'status'}


def test_every_command_is_in_the_table():
    named = {name for name in commands() if any(f'{words} '.startswith(f'{name} ') for words in WRONG)}
    assert set(commands()) == named | TAKES_NOTHING_THAT_CAN_BE_MISSING


@pytest.mark.parametrize('words', WRONG)
def test_a_wrong_use_ends_with_2_and_one_sentence_and_makes_nothing(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    printed = command(*(MISSING if word == '?' else word for word in words.split()), codes=(2,))
    assert WRONG[words] in printed
    assert printed.startswith('engine-mount: ')
    assert printed.count('\n') == 1
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
        ('edit', 'cut', folder, '--from', '0.5s', '--to', '1s', '--out', f'{folder}_cut'),
        ('edit', 'recover', folder / 'recording', '--out', f'{folder}_recovered'),
        ('replay', folder, '--out', f'{folder}_replayed'),
        ('report', folder, '--out', f'{folder}.html'),
        ('calibrate', 'rack', '--out', f'{folder}_rack'),
    ):
        assert 'run [/x] [mm]' in command(*words)
    file = tmp_path / 'a [g].csv'
    file.write_text('Zeit [s],Weg [mm]\n0.0,1.5\n1.0,2.5\n')
    printed = refused('drive', '--core', '--file', file, '--column', 'az [/g]')
    assert all(name in printed for name in ('a [g].csv', 'az [/g]', 'Weg [mm]'))
