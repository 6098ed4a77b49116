"""What racks measure, in every format: `identify` and `calibrate` answer as of the plain CSV file.

Each file is by a writer that is not of this project. Some logs keep times to 0.1 ms only, so what is sampled
over time is compared less strictly than points.
"""

import json

import numpy as np
import pytest
from command import done, refused
from foreign_files import MAKERS, make_csv

from mount_sim.plant.reluctance import ReluctanceActuator, force
from mount_sim.rack.friction import RackNoise, sawtooth

pytestmark = pytest.mark.slow

RACK = sawtooth(noise=RackNoise(seed=4), normal_force=70.0, speeds=(0.002, 0.004, 0.006, 0.01), stroke=1e-3)
TIMES = RACK.time[::2]  # s
FRICTION = {
    'way': ('mm', 1e3 * RACK.displacement[::2]),
    'cell': ('kN', 1e-3 * RACK.friction_force[::2]),
    'load': ('N', np.broadcast_to(RACK.normal_force, RACK.displacement.shape)[::2]),
}
FRICTION_SAID = {'way': 'displacement', 'cell': 'friction_force', 'load': 'normal_force'}
GAPS, CURRENTS = (
    grid.ravel() for grid in np.meshgrid(np.linspace(280.0, 540.0, 9), np.linspace(0.1, 2.5, 14))
)  # um, A
PULLS = np.array(
    [force(ReluctanceActuator(), i, 1e-6 * gap) for i, gap in zip(CURRENTS, GAPS, strict=True)]
)  # N
KNEES = 0.6 + 1.6e-3 * GAPS  # A, with the gap as of an iron core that saturates
INDUCTANCES = 16.0 / (GAPS + 60.0) / (1.0 + (CURRENTS / KNEES) ** 4) * 1e3  # mH
POINTS_SAID = {'Spalt': 'gap', 'Strom': 'current', 'Kraft': 'force', 'Lind': 'inductance'}
FORCES = {'Spalt': ('um', GAPS), 'Strom': ('mA', 1e3 * CURRENTS), 'Kraft': ('N', PULLS)}
RIPPLE = {'Spalt': ('um', GAPS), 'Strom': ('A', CURRENTS), 'Lind': ('mH', INDUCTANCES)}
POINT_TIMES = np.arange(GAPS.size) / 100.0  # s
COIL = ('--coil-temperature', 20, '--rest-current', 0.25, '--crossing-inductance', 15)


def columns(made, units, names):
    """Return the options that say which column is what, with units where the format holds none."""
    for column, (unit, _) in units.items():
        yield '--column'
        yield f'{names[column]}={made.names[column]}' + ('' if made.units else f':{unit}')


def stated(made):
    """Return the options that say what no file of points tells."""
    return [] if made.stated.dbc is None else ['--dbc', made.stated.dbc]


def friction(made, folder, *more):
    """Return the coefficients that `identify friction` finds."""
    rate = [] if made.stated.rate is None else ['--rate', made.stated.rate]
    options = [*columns(made, FRICTION, FRICTION_SAID), *stated(made), *rate, *more]
    done('identify', 'friction', '--step', 'sawtooth', '--train', made.path, *options, '--json', folder / 'f')
    return json.loads((folder / 'f').read_text())['coefficients']


def law(made, folder, *more):
    """Return the parameters that `calibrate actuator` finds."""
    options = [*columns(made, FORCES, POINTS_SAID), *stated(made), *more]
    done('calibrate', 'actuator', made.path, *options, '--json', folder / 'a')
    return json.loads((folder / 'a').read_text())['parameters']


def curves(made, folder, *more):
    """Return the coefficients of both curves that `calibrate inductance` finds."""
    options = [*columns(made, RIPPLE, POINTS_SAID), *stated(made), *COIL, *more]
    done('calibrate', 'inductance', made.path, *options, '--json', folder / 'i')
    found = json.loads((folder / 'i').read_text())['curves']
    return {name: curve['coefficients'] for name, curve in found.items()}


CELLS = {
    'identify friction': (friction, TIMES, FRICTION, 1e-3),
    'calibrate actuator': (law, POINT_TIMES, FORCES, 1e-6),
    'calibrate inductance': (curves, POINT_TIMES, RIPPLE, 1e-6),
}
"""Command: what it finds, of which data, and how near (relative) to what it finds of the CSV file."""


@pytest.fixture(scope='module')
def of_csv(tmp_path_factory):
    """Return what each command finds of a CSV file."""
    folder = tmp_path_factory.mktemp('csv')
    return {
        command: find(make_csv(folder, command.replace(' ', '_'), times, data), folder)
        for command, (find, times, data, _) in CELLS.items()
    }


@pytest.mark.parametrize('command', CELLS)
@pytest.mark.parametrize('kind', [kind for kind in MAKERS if kind != 'csv'])
def test_every_format_gives_what_csv_gives(kind, command, of_csv, tmp_path):
    find, times, data, near = CELLS[command]
    found = find(MAKERS[kind](tmp_path, 'rack', times, data), tmp_path)
    assert found.keys() == of_csv[command].keys()
    for name, values in of_csv[command].items():
        assert found[name] == pytest.approx(values, rel=near, abs=near * np.abs(values).max()), name


def test_frames_without_their_database_are_refused_by_every_command(tmp_path):
    made = MAKERS['asc'](tmp_path, 'rack', TIMES, FRICTION)
    for command in (('identify', 'friction', '--train'), ('calibrate', 'actuator')):
        sentence = refused(*command, made.path)
        assert 'rack.asc holds CAN frames; name the database that decodes them with --dbc' in sentence


def test_a_rate_that_the_times_contradict_is_refused(tmp_path):
    made = make_csv(tmp_path, 'rack', TIMES, FRICTION)
    options = [*columns(made, FRICTION, FRICTION_SAID), '--rate', 1000]
    sentence = refused('identify', 'friction', '--train', made.path, *options)
    assert 'rack.csv: its times tell 500 samples per second, --rate says 1000' in sentence


@pytest.fixture
def grouped(tmp_path):
    """Return a table whose commas may stand between thousands, and what its gaps are if they do not."""
    gaps = GAPS + 0.125 * (GAPS.max() > GAPS)
    lines = ['gap [um];current [A];force [N]']
    for gap, current, pull in zip(gaps, CURRENTS, PULLS, strict=True):
        lines.append(f'{gap:.6g};{current:.6f};{pull:.6f}'.replace('.', ','))
    (tmp_path / 'force.csv').write_text('\n'.join(lines) + '\n')
    return tmp_path / 'force.csv'


def test_a_decimal_sign_that_no_line_tells_is_said(grouped, tmp_path):
    sentence = refused('calibrate', 'actuator', grouped)
    assert 'may be 280.125 or 280125; state it with --decimal' in sentence
    told = done('calibrate', 'actuator', grouped, '--decimal', ',')
    assert '126 points' in told
    (tmp_path / 'rack.yaml').write_text('decimal: ","\n')
    assert done('calibrate', 'actuator', grouped, '--map-file', tmp_path / 'rack.yaml') == told
