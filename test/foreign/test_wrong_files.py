"""Files that are wrong in one thing each: the sentence names file, column, value, guess and remedy."""

import numpy as np
import pytest
from command_line import command as done
from command_line import refused
from foreign_files import MAKERS

TIMES = np.arange(1000) / 200.0
TRAVEL = 0.8 * np.sin(2.0 * np.pi * 8.0 * TIMES)  # mm
SHAKING = 0.6 * np.sin(2.0 * np.pi * 7.0 * TIMES + 0.3)  # m/s^2
GRAVITY = 9.80665


def write(path, header, *columns, delimiter=','):
    np.savetxt(path, np.column_stack(columns), '%.9g', delimiter, header=header, comments='')
    return path


def drive(path, *options):
    order = ['--scenario', 'recorded', '--file', path, *options, '--out', path.parent / 'run']
    sentence = refused('drive', '--core', '--no-report', *order)
    assert not (path.parent / 'run').exists()
    return sentence


def importing(path, *options):
    sentence = refused('import', path, *options, '--out', path.parent / 'made')
    assert not (path.parent / 'made').exists()
    return sentence


T, MS = TIMES, 1e3 * TIMES
WRONG = {
    'g without a unit': (
        drive, ('t,az', T, SHAKING / GRAVITY + 1.0), ('--column', 'az'),
        ("column 'az'", 'a mean of 1', 'could be g', '--column acceleration=az:g'),
    ),
    'header says m/s^2, values are g': (
        drive, ('t [s],az [m/s^2]', T, SHAKING / GRAVITY + 1.0), ('--column', 'az'),
        ("column 'az'", 'a mean of 1', 'gravity in g', '--column acceleration=az:g'),
    ),
    'header says g, values are m/s^2': (
        drive, ('t [s],az [g]', T, SHAKING + GRAVITY), ('--column', 'az'),
        ("column 'az'", '9.81 times gravity', 'could be m/s^2', '--column acceleration=az:m/s^2'),
    ),
    'the hand says g, values are m/s^2': (
        drive, ('t,az', T, SHAKING + GRAVITY), ('--column', 'az:g'),
        ("column 'az'", '9.81 times gravity', 'could be m/s^2', '--column acceleration=az:m/s^2'),
    ),
    'scale -1 on g': (
        drive, ('t,az', T, SHAKING / GRAVITY + 1.0), ('--column', 'az', '--scale', '-1'),
        ("column 'az'", 'scale of -1', 'gravity in g', '--column acceleration=az:g'),
    ),
    'milliseconds': (
        drive, ('t,az', MS, SHAKING), ('--column', 'az:m/s^2'),
        ("column 't'", 'steps of 5', 'look like ms', '--time t:ms'),
    ),
    'no times': (
        drive, ('az', SHAKING), ('--column', 'az:m/s^2'),
        ("column 'az'", 'no times', '--rate HZ'),
    ),
    'a rate that the times contradict': (
        drive, ('t [s],az', T, SHAKING), ('--column', 'az:m/s^2', '--rate', '1000'),
        ('tell 200 samples per second', '--rate says 1000', 'leave --rate out'),
    ),
    'micrometres': (
        importing, ('t,x', T, 1e3 * TRAVEL), ('--column', 'displacement=x'),
        ("column 'x'", 'from -798', 'could be um', '--column displacement=x:um'),
    ),
    'millimetres': (
        importing, ('t,x', T, TRAVEL), ('--column', 'displacement=x'),
        ("column 'x'", 'from -0.798', 'mm', '--column displacement=x:mm'),
    ),
    'the hand says m, values are mm': (
        importing, ('t,x', T, TRAVEL), ('--column', 'displacement=x:m'),
        ("column 'x'", 'a range of 1.597 m', 'mm', '--column displacement=x:mm'),
    ),
    'a unit that is none': (
        importing, ('t,x', T, TRAVEL), ('--column', 'displacement=x:MM'),
        ("'MM'", 'is it mm'),
    ),
    'a column that is not there': (
        importing, ('t,weg', T, TRAVEL), ('--column', 'displacement=x'),
        ("'x'", 't, weg'),
    ),
    'times that stand still': (
        drive, ('t [s],az', 0.0 * T, SHAKING), ('--column', 'az:m/s^2', '--time', 't:s'),
        ("column 'az'", 'does not rise: all samples are at 0 s', '--rate'),
    ),
    'a gap': (
        drive, ('t [s],az', T + 0.4 * (T >= 2.0), SHAKING), ('--column', 'az:m/s^2'),
        ("column 'az'", 'a gap of 0.405 s at 1.995 s', 'cut the recording'),
    ),
    'too slow': (
        importing, ('t [s],x', 20.0 * T, TRAVEL), ('--column', 'displacement=x:mm'),
        ("column 'x'", '10 samples per second', 'at least 100 are needed'),
    ),
    'a fault of the sensor': (
        importing, ('t [s],x', T, TRAVEL + 60.0 * (np.arange(1000) == 321)),
        ('--column', 'displacement=x:mm'),
        ('sample', 'beyond', 'is its unit another one'),
    ),
    'a word among the numbers': (
        importing, ('t [s],Weg [mm]\n0.1,kaputt', T, TRAVEL), (),
        ('kaputt',),
    ),
}  # fmt: skip


@pytest.mark.parametrize('what', WRONG)
def test_what_is_wrong_is_said_with_the_remedy(what, tmp_path):
    command, columns, options, words = WRONG[what]
    path = write(tmp_path / 'drive_17.csv', *columns)
    sentence = command(path, *options)
    assert 'drive_17.csv' in sentence
    for word in words:
        assert word in sentence, sentence


def test_a_mapping_file_with_a_wrong_key_is_refused_with_the_file(tmp_path):
    path = write(tmp_path / 'drive.csv', 't,x', T, TRAVEL)
    (tmp_path / 'rack.yaml').write_text('columns: {displacement: {colum: x}}\n', encoding='utf-8')
    sentence = importing(path, '--map-file', tmp_path / 'rack.yaml')
    assert 'rack.yaml: displacement: colum is not known; known are column, unit, scale, offset' in sentence


def test_a_gap_is_no_reason_to_refuse_an_import(tmp_path):
    path = write(tmp_path / 'drive.csv', 't [s],Weg [mm]', T + 0.4 * (T >= 2.0), TRAVEL)
    printed = done('import', path, '--out', tmp_path / 'made')
    assert 'a gap of 0.405 s at 1.995 s' in printed
    assert (tmp_path / 'made_1').is_dir()
    assert (tmp_path / 'made_2').is_dir()


def test_a_decimal_sign_that_no_line_tells_is_said_by_option_or_mapping_file(tmp_path):
    lines = ['gap [um];current [A];force [N]']
    for gap in range(280, 541, 20):
        for current in np.linspace(0.1, 2.5, 9):
            pull = 80.0 * (current / 2.5) ** 2 * (280.0 / gap) ** 2
            lines.append(f'{gap + 0.125 * (gap < 540):.6g};{current:.6f};{pull:.6f}'.replace('.', ','))
    path = tmp_path / 'force.csv'
    path.write_text('\n'.join(lines) + '\n')
    sentence = refused('calibrate', 'actuator', path)
    assert 'may be 280.125 or 280125; state it with --decimal' in sentence
    told = done('calibrate', 'actuator', path, '--decimal', ',')
    assert '126 points' in told
    (tmp_path / 'rack.yaml').write_text('decimal: ","\n')
    assert done('calibrate', 'actuator', path, '--map-file', tmp_path / 'rack.yaml') == told


def test_frames_without_their_database_are_refused_by_every_command(tmp_path):
    made = MAKERS['asc'](tmp_path, 'rack', TIMES, {'travel': ('mm', TRAVEL)})
    for command in (('identify', 'friction', '--train'), ('calibrate', 'actuator')):
        sentence = refused(*command, made.path)
        assert 'rack.asc holds CAN frames; name the database that decodes them with --dbc' in sentence
