"""`engine-mount calibrate`: files in, a specimen out; every doubt a sentence, and then no file at all."""

import hashlib
import json

import numpy as np
import pytest
import yaml

from engine_mount.cli.command import main
from mount_models.actuator.law import checked_force
from mount_models.coil.gap import evaluate
from mount_models.specimen import load_specimen
from mount_sim.plant.reluctance import force
from mount_sim.rack.coil import drawn_rack, measure_force, record_ripple, write_columns

RACK = drawn_rack(5)
GAPS = np.linspace(280e-6, 540e-6, 8)


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return a force file, and ripple files at 8 gaps and 20 degC, 4 gaps and 80 degC."""
    folder = tmp_path_factory.mktemp('rack')
    points = write_columns(folder / 'force.csv', measure_force(RACK), 'a rack')
    ripple = []
    for celsius, gaps in ((20.0, GAPS), (80.0, GAPS[::2])):
        for gap in gaps:
            columns = record_ripple(RACK, gap, celsius, duration=2.4, peak_current=2.5)
            ripple.append(write_columns(folder / f'{gap * 1e6:.1f}um_{celsius:+.0f}degC.csv', columns))
    return points, ripple


def refused(capsys, *arguments):
    """Return the sentence with which the command refuses."""
    with pytest.raises(SystemExit) as end:
        main(['calibrate', *map(str, arguments)])
    assert end.value.code not in (0, None)
    return ' '.join(capsys.readouterr().err.replace('│', ' ').split())


def changed(file, folder, name='changed.csv', **columns):
    """Write `file` again with columns changed, added, or dropped for None."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith('#')]
    table = dict(
        zip(lines[0].split(','), np.array([line.split(',') for line in lines[1:]], float).T, strict=True)
    )
    measured = dict(table)
    for column, change in columns.items():
        if change is None:
            del table[column]
        else:
            table[column] = change(measured)
    return write_columns(folder / name, table)


@pytest.fixture(scope='module')
def calibrated(files, tmp_path_factory):
    folder = tmp_path_factory.mktemp('out')
    points, ripple = files
    specimen = folder / 'left.yaml'
    for arguments in (
        ['actuator', points, '--figure', folder / 'force.png', '--json', folder / 'force.json'],
        [
            'inductance',
            *ripple,
            '--base',
            specimen,
            '--supply',
            13.5,
            '--figure',
            folder / 'gap.png',
            '--json',
            folder / 'gap.json',
        ],
    ):
        with pytest.raises(SystemExit) as end:
            main(['calibrate', *map(str, arguments), '--name', 'left', '--out', str(specimen)])
        assert end.value.code == 0
    return folder


@pytest.mark.slow
def test_the_specimen_meets_the_actuator_it_was_measured_on(calibrated):
    specimen = load_specimen(calibrated / 'left.yaml', 'left')
    assert specimen.bridge.link_voltage == 13.5  # as told
    gaps, currents = np.linspace(300e-6, 520e-6, 12)[:, np.newaxis], np.linspace(0.3, 3.0, 28)
    truth = np.array([[force(RACK.actuator, i, d) for i in currents] for d in gaps[:, 0]])
    error = (checked_force(specimen.force_law, currents, gaps) / truth - 1.0)[truth > 20.0]
    assert np.sqrt(np.mean(error**2)) <= 0.005
    exact = drawn_rack(5, noise=0.0)
    for gap in np.linspace(300e-6, 500e-6, 5):
        columns = record_ripple(exact, gap, duration=0.3)
        area = RACK.actuator.turns * RACK.actuator.gap_area
        inductance = area * columns['flux_rate_t_per_s'][0] / columns['current_rate_a_per_s'][0]
        # turns_area is that of the base, so inductances are to one scale, which the curves share
        inductance *= specimen.turns_area / area
        found = float(evaluate(specimen.gap_curves.gap_of_inductance, inductance))
        assert found == pytest.approx(gap, abs=1.5e-6)


def test_the_specimen_tells_where_it_comes_from(calibrated, files):
    provenance = load_specimen(calibrated / 'left.yaml').provenance
    law, curves = provenance['parts']['force_law'], provenance['parts']['gap_curves']
    assert law['recordings'] == [
        {'file': 'force.csv', 'sha256': hashlib.sha256(files[0].read_bytes()).hexdigest()}
    ]
    assert len(curves['recordings']) == 12
    assert law['specimen'] == curves['specimen'] == 'left'
    assert law['valid']['gap'] == pytest.approx([270e-6, 550e-6])
    assert law['valid']['current'] == [0.0, 3.0]
    assert np.shape(law['covariance']) == (18, 18)
    assert len(law['residuals']['rms_by_gap']) == 15
    assert law['date'][:2] == '20'
    assert law['versions'].keys() == {'mount_bringup', 'numpy', 'scipy'}


def test_json_and_figures_hold_what_was_found(calibrated):
    law = json.loads((calibrated / 'force.json').read_text())
    assert law['relative_rms'] == pytest.approx(0.01, rel=0.2)
    assert [len(law['parameters'][f'a{n}']) for n in range(1, 6)] == [4, 4, 4, 2, 4]
    gap = json.loads((calibrated / 'gap.json').read_text())
    assert gap['curves']['inductance_of_gap']['largest_gap_std_m'] < 1e-6
    shown = {row['celsius'] for row in gap['temperature']['gap_error_um']}
    assert shown == {20.0, 80.0}
    warm = [
        row
        for row in gap['temperature']['gap_error_um']
        if row['celsius'] == 80.0 and row['source'] == 'fitted'
    ]
    assert warm[0]['rest_um'] < 3.0 < 40.0 < warm[0]['rest_uncompensated_um']
    assert (calibrated / 'force.png').stat().st_size > 20_000
    assert (calibrated / 'gap.png').stat().st_size > 20_000


def test_parts_that_are_still_those_of_the_base_are_named(files, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(
            ['calibrate', 'actuator', str(files[0]), '--name', 'right', '--out', str(tmp_path / 'right.yaml')]
        )
    assert "gap_curves is not yet that of 'right'" in ' '.join(capsys.readouterr().out.split())


def in_kilonewton(table):
    return table['force_n'] / 1e3


def one_stuck(table):
    stuck = table['force_n'].copy()
    stuck[100:130] = stuck[100]
    return stuck


def one_outlier(table):
    forces = table['force_n'].copy()
    forces[200] *= 1.4
    return forces


def one_missing(table):
    forces = table['force_n'].copy()
    forces[7] = np.nan
    return forces


@pytest.mark.parametrize(
    ('columns', 'sentence'),
    [
        (
            {'force_n': None},
            'has no column for force (its columns: gap [um], current_a; read as comma, decimal point, '
            'utf-8); name it as in --column force=',
        ),
        ({'force_n': in_kilonewton}, 'it could be kN, daN, kip, kgf: write --column force=force_n:kN'),
        ({'gap_um': lambda t: t['gap_um'] / 1e3}, 'it could be mm: write --column gap=gap:mm'),
        (
            {'current_a': lambda t: t['current_a'] * 1e3},
            'it could be mA: write --column current=current_a:mA',
        ),
        (
            {'gap_um': None, 'gap': lambda t: t['gap_um']},
            "column 'gap': no unit is said; values from 270 to 550; it could be um",
        ),
        ({'force_n': lambda t: 0.0 * t['current_a'] + 50.0}, 'force is constant (50 N in all 885 rows)'),
        ({'force_n': one_stuck}, 'force stayed at'),
        ({'force_n': one_missing}, "column 'force_n': row 8 is nan (1 such of 885)"),
        ({'force_n': one_outlier}, '1 of 885 points are outliers'),
        ({'force_n': lambda t: -t['force_n']}, 'is the sign of the load cell right?'),
    ],
)
def test_doubtful_points_are_refused_and_no_file_is_written(files, tmp_path, capsys, columns, sentence):
    doubtful = changed(files[0], tmp_path, **columns)
    targets = ['--out', tmp_path / 'o.yaml', '--json', tmp_path / 'o.json', '--figure', tmp_path / 'o.png']
    assert sentence in refused(capsys, 'actuator', doubtful, *targets)
    assert [path.name for path in tmp_path.iterdir()] == ['changed.csv']


@pytest.mark.parametrize(
    ('content', 'suffix', 'sentence'),
    [
        (b'gap_um,current_a,force_n\n300,1,100\n310,1,90\n', '.csv', 'holds 2 points, at least 8 are needed'),
        (
            b'gap_um,current_a,force_n\n300,1,abc\n',
            '.csv',
            'has no column for force',
        ),
        (b'no recording at all', '.mcap', 'mcap'),
        (b'x', '.xlsx', 'no readable Excel workbook'),
    ],
)
def test_files_that_are_no_measurement_are_refused(tmp_path, capsys, content, suffix, sentence):
    file = tmp_path / f'given{suffix}'
    file.write_bytes(content)
    assert sentence in refused(capsys, 'actuator', file, '--out', tmp_path / 'o.yaml').replace('MCAP', 'mcap')
    assert not (tmp_path / 'o.yaml').exists()


def test_a_file_that_does_not_exist_is_refused(tmp_path, capsys):
    assert 'does not exist' in refused(capsys, 'actuator', tmp_path / 'nowhere.csv')


def test_the_same_recording_twice_is_refused(files, tmp_path, capsys):
    copy = tmp_path / 'copy.csv'
    copy.write_bytes(files[0].read_bytes())
    assert 'are the same to the bit' in refused(capsys, 'actuator', files[0], copy)


def test_a_target_without_folder_is_refused_before_the_work(files, tmp_path, capsys):
    target = tmp_path / 'nowhere' / 'left.yaml'
    assert 'must be a file in an existing folder' in refused(capsys, 'actuator', files[0], '--out', target)


def test_columns_of_other_names_are_chosen_with_their_unit(files, tmp_path, capsys):
    other = changed(files[0], tmp_path, force_n=None, Kraft=in_kilonewton)
    assert 'has no column for force' in refused(capsys, 'actuator', other)
    with pytest.raises(SystemExit) as end:
        main(['calibrate', 'actuator', str(other), '--column', 'force=Kraft:kn'])
    assert end.value.code == 0


def test_ripple_without_a_known_gap_is_refused(files, tmp_path, capsys):
    unknown = changed(files[1][0], tmp_path, gap_um=None)
    assert 'its air gap is not known; add --gap changed.csv=UM' in refused(capsys, 'inductance', unknown)


def test_ripple_without_a_known_temperature_is_refused(files, tmp_path, capsys):
    unknown = changed(files[1][0], tmp_path, coil_temperature_c=None)
    assert 'add --coil-temperature DEGC' in refused(capsys, 'inductance', unknown)


@pytest.mark.parametrize(
    ('options', 'sentence'),
    [
        (['--gap', 'changed.csv=0.349'], 'was it meant in mm?'),
        (['--gap', 'other.csv=349'], "'other.csv' is no file of those given"),
        (['--coil-temperature', '293'], 'is it in kelvin?'),
        (['--coil-temperature', 'warm'], "'warm' is no number"),
        (['--rest-current', '-1'], 'must be above 0'),
    ],
)
def test_options_that_make_no_sense_are_refused(files, tmp_path, capsys, options, sentence):
    file = changed(files[1][0], tmp_path)
    assert sentence in refused(capsys, 'inductance', file, *options)


def test_too_few_gaps_are_refused(files, tmp_path, capsys):
    said = refused(capsys, 'inductance', *files[1][:4], '--out', tmp_path / 'o.yaml')
    assert '6 or more air gaps' in said
    assert not (tmp_path / 'o.yaml').exists()


def test_a_gap_that_was_noted_wrongly_is_refused_and_named(files, capsys):
    cold = files[1][:8]
    said = refused(capsys, 'inductance', *cold, '--gap', f'{cold[4].name}=455')
    assert f'{cold[4].name}: by the' in said
    assert 'is the gap of this file right?' in said


def test_an_ambiguous_choice_is_refused(files, capsys):
    said = refused(capsys, 'inductance', *files[1][:8], '--crossing-inductance', 32)
    assert 'the crossing current must rise or fall steadily with the gap' in said


def test_a_base_that_was_edited_to_nonsense_is_refused(calibrated, files, tmp_path, capsys):
    content = yaml.safe_load((calibrated / 'left.yaml').read_text())
    content['force_law']['a4'] = [-5.0, 0.0]
    edited = tmp_path / 'edited.yaml'
    edited.write_text(yaml.safe_dump(content))
    said = refused(capsys, 'actuator', files[0], '--base', edited, '--out', tmp_path / 'o.yaml')
    assert 'the force must' in said
    assert not (tmp_path / 'o.yaml').exists()
