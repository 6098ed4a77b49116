"""`identify` and `calibrate` take what other programs write: each format by a writer of others."""

import json

import numpy as np
import pytest

from engine_mount.identification.friction.channels import friction_mapping
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.rack.columns import RACK
from engine_mount.identification.rack.force_points import read_force
from engine_mount.identification.rack.given import GivenValues
from engine_mount.identification.rack.ripple_recordings import read_ripple
from engine_mount.signals.mapping import Mapping, mapping_in_file, with_options
from engine_mount.signals.signal import SignalError

POUND, INCH = 4.4482216152605, 0.0254
NOTHING = GivenValues({}, {}, 20.0)
TIME = np.arange(2000) / 1000.0
WAY = 1e-3 * np.sin(6.0 * TIME)  # m
FRICTION = 60.0 * np.tanh(40.0 * np.cos(6.0 * TIME))  # N
LOAD = 100.0 + 5.0 * np.cos(TIME)  # N
MOTION = {'Zeit': 1e3 * TIME, 'way': WAY / INCH, 'cell': FRICTION / POUND, 'load': LOAD / POUND / 1e3}
SAID = ['time=Zeit:ms', 'displacement=way:in', 'friction_force=cell:lbf', 'normal_force=load:kip']
GAP, CURRENT = (grid.ravel() for grid in np.meshgrid(np.linspace(300, 500, 6), np.linspace(0.2, 3.0, 9)))
PULL = 300.0 * (CURRENT / 3.0) ** 2 * (300.0 / GAP)
FORCES = {'Spalt': GAP / 25.4, 'Strom': 1e3 * CURRENT, 'Kraft': PULL / POUND}
FORCES_SAID = ['gap=Spalt:mil', 'current=Strom:mA', 'force=Kraft:lbf']


def as_csv(file, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(file, rows, delimiter=',', header=','.join(columns), comments='', fmt='%.15g')


def as_german_csv(file, columns):
    lines = [';'.join(columns)]
    lines += [
        ';'.join(f'{value:.15g}'.replace('.', ',') for value in row)
        for row in zip(*columns.values(), strict=True)
    ]
    file.write_text('\n'.join(lines) + '\n')


def as_npz(file, columns):
    np.savez(file, **columns)


def as_parquet(file, columns):
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table(columns), file)


def as_mat(file, columns):
    from scipy.io import savemat

    savemat(file, columns)


def as_hdf5(file, columns):
    import h5py

    with h5py.File(file, 'w') as written:
        for name, values in columns.items():
            written[name] = values


def as_excel(file, columns):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        book.active.append([float(value) for value in row])
    book.save(file)


def as_mdf(file, columns):
    from asammdf import MDF, Signal

    with MDF(version='4.10') as written:
        size = len(next(iter(columns.values())))
        written.append(
            [Signal(values, np.arange(size) / 1000.0, name=name) for name, values in columns.items()]
        )
        written.save(file)


def as_json(file, columns):
    file.write_text(json.dumps({name: list(map(float, values)) for name, values in columns.items()}))


FORMATS = [
    ('csv', as_csv), ('txt', as_german_csv), ('npz', as_npz), ('parquet', as_parquet), ('mat', as_mat),
    ('h5', as_hdf5), ('xlsx', as_excel), ('mf4', as_mdf), ('json', as_json),
]  # fmt: skip


@pytest.mark.parametrize(('suffix', 'write'), FORMATS, ids=[suffix for suffix, _ in FORMATS])
def test_identify_reads_friction_in_imperial_units_of_every_format(tmp_path, suffix, write):
    file = tmp_path / f'rig.{suffix}'
    write(file, MOTION)
    found = read_recording(file, friction_mapping(SAID))
    assert found.dt == pytest.approx(1e-3)
    assert found.displacement == pytest.approx(WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(FRICTION, rel=1e-9, abs=1e-9)
    assert found.normal_force[:, 1] == pytest.approx(LOAD, rel=1e-9)


@pytest.mark.parametrize(('suffix', 'write'), FORMATS, ids=[suffix for suffix, _ in FORMATS])
def test_calibrate_reads_forces_in_imperial_units_of_every_format(tmp_path, suffix, write):
    file = tmp_path / f'force.{suffix}'
    write(file, FORCES)
    points = read_force([file], with_options(Mapping(), FORCES_SAID, known=RACK), NOTHING)
    assert points.gap == pytest.approx(1e-6 * GAP, rel=1e-9)
    assert points.current == pytest.approx(CURRENT, rel=1e-9)
    assert points.force == pytest.approx(PULL, rel=1e-9)


def test_units_in_titles_are_heard(tmp_path):
    titled = {
        'time [ms]': 1e3 * TIME,
        'displacement [mm]': 1e3 * WAY,
        'friction_force (kip)': FRICTION / POUND / 1e3,
        'normal_force_lbf': LOAD / POUND,
    }
    as_german_csv(tmp_path / 'rig.csv', titled)
    found = read_recording(tmp_path / 'rig.csv')
    assert found.dt == pytest.approx(1e-3)
    assert found.displacement == pytest.approx(WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(FRICTION, rel=1e-9, abs=1e-9)
    assert found.normal_force[:, 0] == pytest.approx(LOAD, rel=1e-9)
    as_excel(
        tmp_path / 'force.xlsx',
        {'gap [mm]': 1e-3 * GAP, 'current [A]': CURRENT, 'force_kip': PULL / POUND / 1e3},
    )
    points = read_force([tmp_path / 'force.xlsx'], Mapping(), NOTHING)
    assert points.gap == pytest.approx(1e-6 * GAP, rel=1e-9)
    assert points.force == pytest.approx(PULL, rel=1e-9)


MAPPING = """
system: rig 2, string potentiometer and load cell
time: {column: Zeit, unit: ms}
columns:
  displacement: {column: way, unit: in, offset: mean}
  force: {column: cell, unit: lbf, scale: -1}
  normal_force: {column: load, unit: kip}
  air_gap: {column: Spalt, unit: mil}
  current: {column: Strom, unit: mA}
"""


def test_a_mapping_file_says_columns_units_axes_and_offsets(tmp_path):
    (tmp_path / 'rig.yaml').write_text(MAPPING)
    as_mat(tmp_path / 'rig.mat', {**MOTION, 'way': MOTION['way'] + 3.0, 'cell': -MOTION['cell']})
    found = read_recording(tmp_path / 'rig.mat', friction_mapping([], mapping_in_file(tmp_path / 'rig.yaml')))
    assert found.displacement == pytest.approx(WAY - WAY.mean(), abs=1e-9)
    assert found.force == pytest.approx(FRICTION, rel=1e-9, abs=1e-9)
    (tmp_path / 'forces.yaml').write_text(
        MAPPING.replace('cell, unit: lbf, scale: -1', 'Kraft, unit: lbf, offset: 2.0')
    )
    as_parquet(tmp_path / 'force.parquet', FORCES)
    chosen = mapping_in_file(tmp_path / 'forces.yaml').of(RACK)
    assert read_force([tmp_path / 'force.parquet'], chosen, NOTHING).force == pytest.approx(PULL - 2.0)


@pytest.mark.parametrize(
    ('scale', 'factor'),
    [('', 1e-3), (', scale: -1', -1e-3), (', scale: 0.001', 1e-3), (', scale: 0.98', None)],
)
def test_a_scale_without_a_unit_stands_beside_the_unit_of_the_header(tmp_path, scale, factor):
    table = {'x [mm]': 1e3 * WAY, 'force [kN]': 1e-3 * FRICTION, 'load [N]': LOAD}
    as_csv(tmp_path / 'rig.csv', {'time [s]': np.arange(len(WAY)) * 1e-3, **table})
    text = (
        f'columns:\n  displacement: {{column: x{scale}}}\n  force: {{column: force, scale: -1}}\n'
        '  normal_force: {column: load}\n'
    )
    (tmp_path / 'rig.yaml').write_text(text)
    chosen = friction_mapping([], mapping_in_file(tmp_path / 'rig.yaml'))
    if factor is None:
        with pytest.raises(SignalError, match=r'says mm \(0.001 m each\), the scale says 0.98'):
            read_recording(tmp_path / 'rig.csv', chosen)
        return
    found = read_recording(tmp_path / 'rig.csv', chosen)
    assert found.displacement == pytest.approx(1e3 * factor * WAY, rel=1e-9, abs=1e-12)
    assert found.force == pytest.approx(-FRICTION, rel=1e-9, abs=1e-9)


def test_a_mapped_unit_of_another_quantity_is_refused(tmp_path):
    as_csv(tmp_path / 'rig.csv', {'t': TIME, 'x': WAY, 'friction_force_n': FRICTION, 'normal_force_n': LOAD})
    (tmp_path / 'rig.yaml').write_text('columns:\n  displacement: {column: x, unit: N}\n')
    with pytest.raises(SignalError, match='is in N, as you say: that is of force'):
        read_recording(tmp_path / 'rig.csv', friction_mapping([], mapping_in_file(tmp_path / 'rig.yaml')))


def test_ripple_tables_are_read_of_other_formats_too(tmp_path):
    table = {'gap_um': GAP, 'current_a': CURRENT, 'inductance_mh': 20.0 / (1.0 + CURRENT) * (300.0 / GAP)}
    as_mdf(tmp_path / 'L.mf4', table)
    as_csv(tmp_path / 'L.csv', table)
    for one, other in zip(
        read_ripple([tmp_path / 'L.mf4'], Mapping(), NOTHING, 0.1),
        read_ripple([tmp_path / 'L.csv'], Mapping(), NOTHING, 0.1),
        strict=True,
    ):
        np.testing.assert_allclose(one.inductance, other.inductance, rtol=1e-12)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('displacement=way:lbf', 'is in lbf, as you say: that is of force, but displacement is of length'),
        ('friction_force=cell:g', 'that is of acceleration, but friction_force is of force'),
        ('friction_force=load_cell:N', "has no column 'load_cell'"),
    ],
)
def test_a_unit_of_another_quantity_is_refused(tmp_path, text, words):
    as_csv(tmp_path / 'rig.csv', MOTION)
    said = {one.partition('=')[0]: one for one in (*SAID, text)}
    with pytest.raises(SignalError, match=words):
        read_recording(tmp_path / 'rig.csv', friction_mapping(said.values()))


def test_a_column_that_is_not_there_and_a_unit_of_another_quantity_are_refused(tmp_path):
    as_npz(tmp_path / 'force.npz', FORCES)
    with pytest.raises(SignalError, match=r"no column 'Luft'; its columns are .*Spalt, Strom, Kraft"):
        read_force(
            [tmp_path / 'force.npz'],
            with_options(Mapping(), ['gap=Luft:mm', *FORCES_SAID[1:]], known=RACK),
            NOTHING,
        )
    with pytest.raises(SignalError, match='is in lbf, as you say: that is of force, but gap is of length'):
        read_force(
            [tmp_path / 'force.npz'],
            with_options(Mapping(), ['gap=Spalt:lbf', *FORCES_SAID[1:]], known=RACK),
            NOTHING,
        )
