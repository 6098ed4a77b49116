"""`engine-mount calibrate`: files in, a specimen out; every doubt a sentence, and then no file at all."""

import hashlib
import json

import numpy as np
import pytest
from command_line import command, refused

from mount_models.specimen import load_specimen
from mount_sim.rack import drawn_rack, measure_force, record_ripple, write_columns

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


def changed(file, folder, **columns):
    """Write `file` again as `changed.csv` with columns changed, or dropped for None."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith('#')]
    values = np.array([line.split(',') for line in lines[1:]], float).T
    table = dict(zip(lines[0].split(','), values, strict=True))
    table |= {name: change(table) if change else None for name, change in columns.items()}
    kept = {name: column for name, column in table.items() if column is not None}
    return write_columns(folder / 'changed.csv', kept)


@pytest.fixture(scope='module')
def calibrated(files, tmp_path_factory):
    folder = tmp_path_factory.mktemp('out')
    points, ripple = files
    specimen = ('--name', 'left', '--out', folder / 'left.yaml')
    for kind, words in (
        ('actuator', [points]),
        ('inductance', [*ripple, '--base', folder / 'left.yaml', '--supply', 13.5]),
    ):
        targets = ('--figure', folder / f'{kind}.png', '--json', folder / f'{kind}.json')
        printed = command('calibrate', kind, *words, *targets, *specimen)
        assert ("gap_curves is not yet that of 'left'" in ' '.join(printed.split())) == (kind == 'actuator')
    return folder


def test_the_specimen_tells_where_it_comes_from(calibrated, files):
    specimen = load_specimen(calibrated / 'left.yaml', 'left')
    assert specimen.bridge.link_voltage == 13.5  # as told
    law, curves = (specimen.provenance['parts'][part] for part in ('force_law', 'gap_curves'))
    assert law['recordings'] == [
        {'file': 'force.csv', 'sha256': hashlib.sha256(files[0].read_bytes()).hexdigest()}
    ]
    assert len(curves['recordings']) == 12
    assert law['valid']['gap'] == pytest.approx([270e-6, 550e-6])
    assert law['valid']['current'] == [0.0, 3.0]
    assert np.shape(law['covariance']) == (18, 18)


def test_json_and_figures_hold_what_was_found(calibrated):
    law, gap = (json.loads((calibrated / f'{kind}.json').read_text()) for kind in ('actuator', 'inductance'))
    assert law['relative_rms'] == pytest.approx(0.01, rel=0.2)
    assert gap['curves']['inductance_of_gap']['largest_gap_std_m'] < 1e-6
    errors = {(row['celsius'], row['source']): row for row in gap['temperature']['gap_error_um']}
    warm = errors[80.0, 'fitted']
    assert warm['rest_um'] < 3.0 < 40.0 < warm['rest_uncompensated_um']
    assert all((calibrated / f'{kind}.png').stat().st_size > 20_000 for kind in ('actuator', 'inductance'))


def one_stuck(table):
    return np.where((np.arange(885) >= 100) & (np.arange(885) < 130), 50.0, table['force_n'])


@pytest.mark.parametrize(
    ('columns', 'sentence'),
    [
        ({'force_n': None}, 'has no column for force (its columns: gap [um], current_a; read as comma,'),
        ({'force_n': lambda t: t['force_n'] / 1e3}, 'it could be kN, daN, kip, kgf: write --column force='),
        ({'force_n': one_stuck}, 'force stayed at'),
        ({'force_n': lambda t: -t['force_n']}, 'is the sign of the load cell right?'),
    ],
)
def test_doubtful_points_are_refused_and_no_file_is_written(files, tmp_path, columns, sentence):
    doubtful = changed(files[0], tmp_path, **columns)
    targets = ['--out', tmp_path / 'o.yaml', '--json', tmp_path / 'o.json', '--figure', tmp_path / 'o.png']
    assert sentence in refused('calibrate', 'actuator', doubtful, *targets)
    assert [path.name for path in tmp_path.iterdir()] == ['changed.csv']


@pytest.mark.parametrize(
    ('column', 'options', 'sentence'),
    [
        ('gap_um', [], 'its air gap is not known; add --gap changed.csv=UM'),
        ('current_a', [], 'gap curves need inductance over current at each gap'),
        ('coil_temperature_c', [], 'add --coil-temperature DEGC'),
        ('', ['--gap', 'changed.csv=0.349'], 'was it meant in mm?'),
        ('', ['--gap', 'other.csv=349'], "'other.csv' is no file of those given"),
        ('', ['--coil-temperature', '293'], 'was it meant in kelvin?'),
        ('', ['--coil-temperature', 'warm'], "'warm' is no number"),
        ('', ['--rest-current', '-1'], 'greater than or equal to 0.001'),
        ('', [], '6 or more air gaps'),
        ('', ['--out', 'nowhere/left.yaml'], 'must be a file in an existing folder'),
    ],
)
def test_ripple_and_options_that_make_no_sense_are_refused(
    files, tmp_path, monkeypatch, column, options, sentence
):
    monkeypatch.chdir(tmp_path)
    file = changed(files[1][0], tmp_path, **({column: None} if column else {}))
    assert sentence in refused('calibrate', 'inductance', file, *options)


def test_a_recording_under_two_names_is_refused(files, tmp_path):
    copy = tmp_path / 'copy.csv'
    copy.write_bytes(files[0].read_bytes())
    assert 'are the same to the bit' in refused('calibrate', 'actuator', files[0], copy)
