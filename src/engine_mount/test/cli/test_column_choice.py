"""Every command chooses a column alike: name, unit, scale, offset and times, by option and mapping file."""

import numpy as np
import pytest

from engine_mount.cli.rack import rack_mapping
from engine_mount.drives.external_excitation import recorded_acceleration
from engine_mount.identification.friction.files import friction_mapping, read_recording
from engine_mount.identification.rack import FileValues, read_force
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing import read_file
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
    unit, path = {1e-3: 'mm', GRAVITY: 'g', 1e3: 'kN'}[factor], mapping(quantity, 0.98)
    path.write_text(path.read_text().replace('scale', f'unit: {unit}, scale'))
    if read is not invert:  # with its unit beside it a scale is a calibration
        assert read(file, path) == pytest.approx(0.98 * values, rel=1e-9, abs=1e-9 * np.abs(values).max())


MOTION = {'Zeit': 1e3 * TIME, 'way': WAY / INCH, 'cell': FORCE / POUND, 'load': LOAD / POUND / 1e3}


def test_titles_of_rigs_tell_quantity_and_unit(tmp_path):
    titled = {
        'time [ms]': 1e3 * TIME, 'displacement [mm]': 1e3 * WAY, 'friction_force (kip)': FORCE / POUND / 1e3,
        'normal_force_n': LOAD,
    }  # fmt: skip
    found = read_recording(write_csv(tmp_path / 'rig.csv', titled))
    assert found.dt == pytest.approx(1e-3)
    assert found.displacement == pytest.approx(WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(FORCE, rel=1e-9, abs=1e-9)


def test_a_mapping_file_says_units_axes_offsets_and_times_of_rigs(tmp_path):
    (tmp_path / 'rig.yaml').write_text(
        'time: {column: Zeit, unit: ms}\ncolumns:\n  displacement: {column: way, unit: in, offset: mean}\n'
        '  force: {column: cell, unit: lbf, scale: -1}\n  normal_force: {column: load, unit: kip}\n'
    )
    write_csv(tmp_path / 'rig.csv', {**MOTION, 'way': MOTION['way'] + 3.0, 'cell': -MOTION['cell']})
    found = read_recording(tmp_path / 'rig.csv', friction_mapping([], mapping_in_file(tmp_path / 'rig.yaml')))
    assert found.displacement == pytest.approx(WAY - WAY.mean(), abs=1e-9)
    assert found.force == pytest.approx(FORCE, rel=1e-9, abs=1e-9)
