"""Every command chooses a column alike: name, unit, scale, offset and times, by option and mapping file."""

import numpy as np
import pytest

from engine_mount.cli.calibration.given import rack_mapping
from engine_mount.drives.external_excitation import recorded_acceleration
from engine_mount.identification.friction.files import friction_mapping, read_recording
from engine_mount.identification.rack import FileValues, read_force
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing.reading import read_file
from engine_mount.signals.mapping import Mapping, mapping_in_file, with_options
from engine_mount.signals.selection import select
from engine_mount.signals.signal import SignalError

GRAVITY, POUND, INCH = 9.80665, 4.4482216152605, 0.0254
NOTHING = FileValues()
TIME = np.arange(2000) / 1000.0
WAY = 1e-3 * np.sin(2.0 * np.pi * 8.0 * TIME)  # m
SHAKING = 3.0 * np.sin(2.0 * np.pi * 8.0 * TIME)  # m/s^2
FORCE = 60.0 * np.tanh(4.0 * np.cos(2.0 * np.pi * 8.0 * TIME))  # N
LOAD = 100.0 + 5.0 * np.cos(TIME)  # N
COLUMNS = {
    'time [s]': TIME, 'x [mm]': 1e3 * WAY, 'az [g]': SHAKING / GRAVITY, 'F [kN]': 1e-3 * FORCE,
    'load [N]': LOAD, 'd [um]': 300.0 + TIME, 'i [A]': 1.0 + TIME,
}  # fmt: skip


def drive(file, mapping):
    return np.load(recorded_acceleration(str(file), [], mapping_file=mapping).write(file.parent / 'given'))


def imported(file, mapping):
    chosen = mapping_in_file(mapping)
    return read_file(file, chosen.only(chosen.columns)).signals['displacement'].values


def invert(file, mapping):
    scale = mapping_in_file(mapping).columns['acceleration'].scale
    said = with_options(Mapping(), ['acceleration=az'], scale=scale)
    return select(file, said).signals['acceleration'].values


def identify(file, mapping):
    return read_recording(file, friction_mapping([], mapping_in_file(mapping))).displacement


def calibrate(file, mapping):
    return read_force([file], rack_mapping([], mapping_in_file(mapping), Stated()), NOTHING).force


FAMILIES = [
    (drive, 'acceleration', GRAVITY, SHAKING),
    (invert, 'acceleration', GRAVITY, SHAKING),
    (imported, 'displacement', 1e-3, WAY),
    (identify, 'displacement', 1e-3, WAY),
    (calibrate, 'force', 1e3, FORCE),
]  # fmt: skip


def write_csv(file, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(file, rows, delimiter=',', header=','.join(columns), comments='', fmt='%.15g')
    return file


@pytest.fixture
def rig(tmp_path):
    """A table with a unit in each header, and a function that writes a mapping file with one scale."""

    def mapping(quantity, scale):
        named = {'displacement': 'x', 'acceleration': 'az', 'force': 'F', 'normal_force': 'load'}
        lines = [
            f'  {name}: {{column: {column}{f", scale: {scale}" if scale and name == quantity else ""}}}'
            for name, column in {**named, 'air_gap': 'd', 'current': 'i'}.items()
        ]
        (tmp_path / 'rig.yaml').write_text('\n'.join(['columns:', *lines]) + '\n')
        return tmp_path / 'rig.yaml'

    return write_csv(tmp_path / 'rig.csv', COLUMNS), mapping


@pytest.mark.parametrize(('read', 'quantity', 'factor', 'values'), FAMILIES)
def test_a_scale_without_a_unit_never_multiplies_the_unit_of_the_header(rig, read, quantity, factor, values):
    file, mapping = rig
    for scale, sign in (('', 1.0), (1.0, 1.0), (-1.0, -1.0), (factor, 1.0), (-factor, -1.0)):
        found = read(file, mapping(quantity, scale))
        assert found == pytest.approx(sign * values, rel=1e-9, abs=1e-9 * np.abs(values).max()), scale
    for scale in (0.98, 0.0001, 2.0 * factor):
        with pytest.raises(SignalError, match=r'its header says (g|mm|kN) \(.* each\), the scale says'):
            read(file, mapping(quantity, scale))


@pytest.mark.parametrize(('read', 'quantity', 'factor', 'values'), FAMILIES)
def test_a_unit_beside_it_makes_a_scale_a_calibration(rig, read, quantity, factor, values):
    file, mapping = rig
    unit = {1e-3: 'mm', GRAVITY: 'g', 1e3: 'kN'}[factor]
    path = mapping(quantity, 0.98)
    path.write_text(path.read_text().replace('scale', f'unit: {unit}, scale'))
    if read is not invert:
        assert read(file, path) == pytest.approx(0.98 * values, rel=1e-9, abs=1e-9 * np.abs(values).max())


MOTION = {'Zeit': 1e3 * TIME, 'way': WAY / INCH, 'cell': FORCE / POUND, 'load': LOAD / POUND / 1e3}
MOTION_SAID = ['time=Zeit:ms', 'displacement=way:in', 'friction_force=cell:lbf', 'normal_force=load:kip']
GAP, CURRENT = (grid.ravel() for grid in np.meshgrid(np.linspace(300, 500, 6), np.linspace(0.2, 3.0, 9)))
PULL = 300.0 * (CURRENT / 3.0) ** 2 * (300.0 / GAP)
FORCES = {'Spalt': GAP / 25.4, 'Strom': 1e3 * CURRENT, 'Kraft': PULL / POUND}
FORCES_SAID = ['gap=Spalt:mil', 'current=Strom:mA', 'force=Kraft:lbf']


def test_rigs_and_racks_are_read_in_imperial_units(tmp_path):
    found = read_recording(write_csv(tmp_path / 'rig.csv', MOTION), friction_mapping(MOTION_SAID))
    assert found.dt == pytest.approx(1e-3)
    assert found.displacement == pytest.approx(WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(FORCE, rel=1e-9, abs=1e-9)
    assert found.normal_force[:, 1] == pytest.approx(LOAD, rel=1e-9)
    mapping = rack_mapping(FORCES_SAID, Mapping(), Stated())
    points = read_force([write_csv(tmp_path / 'force.csv', FORCES)], mapping, NOTHING)
    assert points.gap == pytest.approx(1e-6 * GAP, rel=1e-9)
    assert points.current == pytest.approx(CURRENT, rel=1e-9)
    assert points.force == pytest.approx(PULL, rel=1e-9)


def test_titles_of_rigs_and_racks_tell_quantity_and_unit(tmp_path):
    titled = {
        'time [ms]': 1e3 * TIME, 'displacement [mm]': 1e3 * WAY, 'friction_force (kip)': FORCE / POUND / 1e3,
        'normal_force_n': LOAD,
    }  # fmt: skip
    found = read_recording(write_csv(tmp_path / 'rig.csv', titled))
    assert found.dt == pytest.approx(1e-3)
    assert found.displacement == pytest.approx(WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(FORCE, rel=1e-9, abs=1e-9)
    titled = {'gap [mm]': 1e-3 * GAP, 'current_a': CURRENT, 'force_kn': 1e-3 * PULL}
    points = read_force([write_csv(tmp_path / 'F.csv', titled)], Mapping(), NOTHING)
    assert points.gap == pytest.approx(1e-6 * GAP, rel=1e-9)
    assert points.force == pytest.approx(PULL, rel=1e-9)


def test_a_mapping_file_says_units_axes_offsets_and_times_of_rigs(tmp_path):
    (tmp_path / 'rig.yaml').write_text(
        'time: {column: Zeit, unit: ms}\ncolumns:\n  displacement: {column: way, unit: in, offset: mean}\n'
        '  force: {column: cell, unit: lbf, scale: -1}\n  normal_force: {column: load, unit: kip}\n'
    )
    write_csv(tmp_path / 'rig.csv', {**MOTION, 'way': MOTION['way'] + 3.0, 'cell': -MOTION['cell']})
    found = read_recording(tmp_path / 'rig.csv', friction_mapping([], mapping_in_file(tmp_path / 'rig.yaml')))
    assert found.displacement == pytest.approx(WAY - WAY.mean(), abs=1e-9)
    assert found.force == pytest.approx(FORCE, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ('said', 'words'),
    [
        ('displacement=way:lbf', 'is in lbf, as you say: that is of force, but displacement is of length'),
        ('friction_force=load_cell:N', "has no column 'load_cell'"),
        ('normal_force=load', 'no unit is said; values from'),
        ('displacement=way:km', r'a range of 78\.7\d m is more than the 1 m'),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, said, words):
    options = {one.partition('=')[0]: one for one in (*MOTION_SAID, said)}
    with pytest.raises(SignalError, match=words):
        read_recording(write_csv(tmp_path / 'rig.csv', MOTION), friction_mapping(options.values()))
