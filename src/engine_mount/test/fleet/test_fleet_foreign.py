"""Files of others in a fleet: rows of a catalogue and of a result, by mapping files, or with the reason."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from engine_mount.drives.inputs.foreign import foreign_order
from engine_mount.drives.replay import parsed_changes, replay
from engine_mount.fleet import before_and_after as pictures
from engine_mount.fleet.catalogue.index import indexed
from engine_mount.fleet.catalogue.places import places
from engine_mount.fleet.foreign import NOTHING_SAID, said_in
from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet
from engine_mount.fleet.worst import said_of, worst
from engine_mount.recordings.recording import Recording

REFERENCES = Path(__file__).parents[4] / 'bags' / 'reference'
CHANGES = parsed_changes({'highest_current': 0.7})
TIMES = np.arange(2000) / 500.0  # s
TRAVEL = 1.2e-3 * np.sin(2.0 * np.pi * 8.0 * TIMES)  # m
SHAKING = 3.0 * np.sin(2.0 * np.pi * 8.0 * TIMES)  # m/s^2
RACK = 'columns: {displacement: {column: Weg}}\n'
CAR = 'columns: {acceleration: {column: az, unit: g, scale: -1}, speed: {column: v, unit: km/h}}\n'


def write(path, head, *columns):
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack(columns), delimiter=',', header=head, comments='')
    return path


@pytest.fixture
def drives(tmp_path):
    """A recording of this project in its run folder, and files of two measuring systems, some wrong."""
    folder = tmp_path / 'drives'
    shutil.copytree(REFERENCES / 'opening', folder / 'run' / 'recording')
    (folder / 'run' / 'summary.json').write_text('{"figures": [1, 2, 3]}')
    write(folder / 'rack' / 'good.csv', 't [s],Weg [mm]', TIMES, 1e3 * TRAVEL)
    write(folder / 'rack' / 'without_unit.csv', 't,Weg', TIMES, 1e3 * TRAVEL)
    late = TIMES + 0.4 * (TIMES >= 2.0)
    write(folder / 'rack' / 'gap.csv', 't [s],Weg [mm]', late, 1e3 * TRAVEL)
    write(folder / 'car' / 'rough.csv', 't [s],az,v', TIMES, SHAKING / 9.80665 - 1.0, 36.0 + 0.0 * TIMES)
    write(folder / 'car' / 'other.csv', 't [s],Kraft [N]', TIMES, 100.0 * TRAVEL)
    (folder / 'car' / 'garbage.mf4').write_bytes(b'no measurement')
    return folder


@pytest.fixture
def said(tmp_path):
    for name, text in (('rack', RACK), ('car', CAR)):
        (tmp_path / f'{name}.yaml').write_text(text, encoding='utf-8')
    return said_in([tmp_path / 'rack.yaml', tmp_path / 'car.yaml'])


def rows_of(table):
    return {row['recording']: row for row in table.to_pylist()}


def replayed(order, folder):
    return rows_of(replay_fleet(order, folder).table)


def test_each_file_is_read_by_its_mapping_and_what_is_wrong_is_a_row(drives, said, tmp_path, inside):
    found = rows_of(indexed([drives], tmp_path / 'catalogue', said).recordings)
    assert found.pop('run/recording')['kind'] == 'replay'
    assert set(found) == {
        'rack/good.csv', 'rack/without_unit.csv', 'rack/gap.csv', 'car/rough.csv', 'car/other.csv',
        'car/garbage.mf4',
    }  # fmt: skip
    good = found['rack/good.csv']
    assert (good['kind'], good['reason']) == ('foreign', '')
    assert json.loads(good['columns']) == {'t': 's', 'Weg': 'mm'}
    assert json.loads(good['mapped']) == {'displacement': 'Weg'}
    assert good['mapping_file'].endswith('/rack.yaml')
    assert (good['duration_s'], good['rate_hz']) == pytest.approx((3.998, 500.0))
    assert good['peak_displacement_m'] == pytest.approx(1.2e-3, rel=0.01)
    assert good['rms_displacement_m'] == pytest.approx(1.2e-3 / np.sqrt(2.0), rel=0.01)
    assert good['rms_3_14_hz_m'] == pytest.approx(1.2e-3 / np.sqrt(2.0), rel=0.1)
    rough = found['car/rough.csv']
    assert rough['reason'] == ''
    assert rough['rms_acceleration_m_s2'] == pytest.approx(3.0 / np.sqrt(2.0), rel=0.01)
    assert rough['distance_m'] == pytest.approx(10.0 * rough['duration_s'])
    assert rough['peak_displacement_m'] is None
    unit = found['rack/without_unit.csv']
    assert unit['kind'] == 'foreign'
    assert "column 'Weg': no unit is said" in unit['reason']
    assert 'write displacement: {column: Weg, unit: mm} into its mapping file' in unit['reason']
    gap = found['rack/gap.csv']
    assert 'a gap of 0.402 s' in gap['reason']
    assert gap['duration_s'] == pytest.approx(4.398)
    assert gap['peak_displacement_m'] is None
    assert (
        'no column that rack.yaml, car.yaml names; its columns are t, Kraft'
        in found['car/other.csv']['reason']
    )
    assert found['car/garbage.mf4']['kind'] == 'unreadable'
    assert found['car/garbage.mf4']['reason']


@pytest.mark.slow
def test_only_what_changed_is_read_again_or_is_said_otherwise(drives, said, tmp_path, inside):
    catalogue = tmp_path / 'catalogue'
    indexed([drives], catalogue, said)
    inside.clear()
    assert indexed([drives], catalogue, said).unchanged == 7
    assert inside == []
    (tmp_path / 'rack.yaml').write_text(RACK.replace('Weg', 'Weg, unit: mm'), encoding='utf-8')
    other = said_in([tmp_path / 'rack.yaml', tmp_path / 'car.yaml'])
    found = indexed([drives], catalogue, other)
    assert (found.read, found.unchanged) == (6, 1)
    assert rows_of(found.recordings)['rack/without_unit.csv']['reason'] == ''


def test_without_a_mapping_file_only_a_file_that_is_named_is_looked_at(drives, tmp_path, inside):
    assert list(rows_of(indexed([drives], tmp_path / 'a').recordings)) == ['run/recording']
    table = write(drives.parent / 'table.csv', 't [s],displacement [mm]', TIMES, 1e3 * TRAVEL)
    row = rows_of(indexed([table], tmp_path / 'b').recordings)['table.csv']
    assert (row['kind'], row['reason'], row['mapping_file']) == ('foreign', '', '')
    assert row['peak_displacement_m'] == pytest.approx(1.2e-3, rel=0.01)


@pytest.mark.slow
def test_tables_of_a_fleet_and_what_lies_in_a_run_are_no_files_of_others(drives, said, tmp_path, inside):
    indexed([drives], drives / 'catalogue', said)
    assert len(indexed([drives], tmp_path / 'catalogue', said).recordings) == 7


def test_a_recording_of_this_project_is_opened_once(drives, said, tmp_path, inside, monkeypatch):
    opened, opens = [], Recording.__init__
    monkeypatch.setattr(Recording, '__init__', lambda self, path: (opened.append(path), opens(self, path))[1])
    indexed([drives / 'run'], tmp_path / 'catalogue', said)
    assert opened == [drives / 'run' / 'recording']
    opened.clear()
    replayed(FleetOrder([str(drives / 'run')], CHANGES, said=said), tmp_path / 'result')
    assert opened == [drives / 'run' / 'recording']


def test_an_array_with_its_times_is_one_place(tmp_path):
    for name in ('IMU/t', 'IMU/value', 'a_t.npy', 'a_value.npy'):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = places([str(tmp_path)], others=True).values()
    assert [place.recording for place in found] == ['IMU', 'a_value.npy']


def test_setpoints_are_those_of_a_replay_with_the_same_mapping(drives, said, tmp_path, inside):
    rows = replayed(FleetOrder([str(drives)], CHANGES, said=said), tmp_path / 'result')
    row = rows['rack/good.csv']
    assert (row['reason'], row['as_recorded'], row['recorded_with']) == ('', None, '')
    foreign = foreign_order(['displacement=Weg'])
    for changes, column in (({}, 'peak_current_a'), (CHANGES, 'peak_current_changed_a')):
        outcome = replay(drives / 'rack' / 'good.csv', changes, foreign=foreign)
        setpoints = outcome.replayed.runs[0].setpoints
        assert row[column] == pytest.approx(setpoints.max(), abs=1e-9)
    assert row['peak_current_a'] > row['peak_current_changed_a'] == 0.7
    assert rows['run/recording']['as_recorded'] is True
    assert 'no unit is said' in rows['rack/without_unit.csv']['reason']
    assert 'engine-mount import makes recordings of its 2 parts' in rows['rack/gap.csv']['reason']
    assert 'no column is mapped as displacement' in rows['car/rough.csv']['reason']


def test_a_closed_loop_drives_over_a_mapped_acceleration(drives, said, tmp_path, inside):
    result = tmp_path / 'result'
    rows = replayed(FleetOrder([str(drives / 'car')], CHANGES, closed_loop=True, said=said), result)
    row = rows['rough.csv']
    assert row['reason'] == ''
    assert row['peak_displacement_m'] > 1e-4
    assert abs(row['displacement_difference_largest_m']) > 0.0
    (one,) = worst(result, 'displacement_difference_largest_m', 1)
    said_again = said_of(result)
    signals = pictures.before_and_after(one.uri, one.changes, closed_loop=True, said=said_again)
    before, after = signals.displacements
    place = int(np.argmax(np.abs(after - before)))
    assert after[place] - before[place] == row['displacement_difference_largest_m']
    assert signals.time[place] == pytest.approx(row['displacement_difference_largest_at_s'])
    assert signals.given.std() == pytest.approx(3.0 / np.sqrt(2.0), rel=0.02)
    assert one.commands[1].startswith(
        f'engine-mount drive --core --scenario recorded --file {one.uri} --map-file '
    )


def test_the_commands_of_a_file_of_others_name_its_mapping(drives, said, tmp_path, inside):
    result = tmp_path / 'result'
    replayed(FleetOrder([str(drives / 'rack')], CHANGES, said=said), result)
    (one,) = worst(result, 'peak_current_a', 1)
    file = drives / 'rack' / 'good.csv'
    assert one.commands == [
        f'engine-mount info {file}',
        f'engine-mount replay {file} --map-file {tmp_path / "rack.yaml"} '
        '--set mount_control.highest_current=0.7',
    ]


def test_the_commands_of_a_row_of_the_catalogue_do_the_same_without_a_change(drives, said, tmp_path, inside):
    indexed([drives / 'rack'], tmp_path / 'catalogue', said)
    (one,) = worst(tmp_path / 'catalogue', 'peak_displacement_m')
    file = drives / 'rack' / 'good.csv'
    assert one.commands == [
        f'engine-mount info {file}',
        f'engine-mount replay {file} --map-file {tmp_path / "rack.yaml"}',
    ]


def test_an_order_with_another_mapping_is_another_order(drives, said, tmp_path, inside):
    assert 'of_others' not in FleetOrder([str(drives)], CHANGES, said=NOTHING_SAID).told()
    told = FleetOrder([str(drives)], CHANGES, said=said).told()
    (tmp_path / 'rack.yaml').write_text(RACK.replace('Weg', 'Weg, unit: mm'), encoding='utf-8')
    other = said_in([tmp_path / 'rack.yaml', tmp_path / 'car.yaml'])
    assert FleetOrder([str(drives)], CHANGES, said=other).told() != told
