"""The catalogue: a row for each mount of each recording, whatever is wrong; read again only when changed."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from references import REFERENCES_FOLDER

import engine_mount
from engine_mount.fleet.catalogue import index, rows_of
from engine_mount.fleet.job import COLUMNS, schema_of
from engine_mount.fleet.places import places
from engine_mount.signals.sources.uris import SourceError


@pytest.fixture
def drives(tmp_path):
    """A folder of recordings: one whole, one cut off, one without its description, and what is none."""
    folder = tmp_path / 'drives'
    for name in ('a/gap', 'b/rough', 'b/initialisation'):
        shutil.copytree(REFERENCES_FOLDER / Path(name).name, folder / name)
    file = next((folder / 'b' / 'rough').glob('*.mcap'))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (folder / 'b' / 'initialisation' / 'metadata.yaml').unlink()
    (folder / 'garbage.mcap').write_bytes(b'no recording')
    (folder / 'notes.txt').write_text('nothing')
    return folder


def row_of(table, recording):
    (row,) = [row for row in table.to_pylist() if row['recording'] == recording]
    return row


def test_a_row_tells_what_a_recording_is_and_what_was_lost_in_it(drives, tmp_path, inside):
    table = index([drives], tmp_path / 'catalogue').recordings
    assert table.schema.equals(schema_of(COLUMNS['recordings']))
    assert table['recording'].to_pylist() == ['a/gap', 'b/initialisation', 'b/rough', 'garbage.mcap']
    gap = row_of(table, 'a/gap')
    assert (gap['kind'], gap['whole'], gap['reason'], gap['scenario']) == ('replay', True, '', 'motorway')
    assert gap['lost_samples'] == gap['faults'] == 0
    assert json.loads(gap['parameters'])['mount_sim.motorway.gap_depth'] == 0.03
    recording = engine_mount.open(REFERENCES_FOLDER / 'gap')
    assert gap['rest_gap_m'] == recording['air_gap']['rest_gap'][-1]
    assert gap['peak_displacement_m'] == np.abs(recording['displacement']['mount']).max()
    rough = row_of(table, 'b/rough')
    assert rough['whole'] is False
    assert rough['lost_messages'] > 0
    assert 'ends without its footer' in rough['reason']
    assert row_of(table, 'b/initialisation')['scenario'] == 'bench'
    garbage = row_of(table, 'garbage.mcap')
    assert garbage['kind'] == 'unreadable'
    assert garbage['reason'].startswith('garbage.mcap is no MCAP file')
    assert garbage['samples'] is None


def test_events_have_their_recording_and_their_time(drives, tmp_path, inside):
    made = index([drives], tmp_path / 'catalogue')
    recordings, events = made.recordings, made.events
    assert events.schema.equals(schema_of(COLUMNS['events']))
    assert set(events['uri'].to_pylist()) <= set(recordings['uri'].to_pylist())
    gap = [row for row in events.to_pylist() if row['recording'] == 'a/gap']
    assert [row['kind'] for row in gap] == ['switch_on', 'switch_off']
    assert 0.0 < gap[0]['time_s'] < gap[1]['time_s'] < 6.9


def test_only_what_changed_is_read_again_and_what_is_gone_leaves(drives, tmp_path, inside):
    catalogue = tmp_path / 'catalogue'
    index([drives], catalogue)
    before = (catalogue / 'recordings.parquet').read_bytes()
    inside.clear()
    again = index([drives], catalogue)
    assert inside == []
    assert (again.read, again.unchanged, again.unreadable) == (0, 4, 1)
    assert (catalogue / 'recordings.parquet').read_bytes() == before
    shutil.rmtree(drives / 'a' / 'gap')
    shutil.rmtree(drives / 'b' / 'rough')
    shutil.copytree(REFERENCES_FOLDER / 'opening', drives / 'b' / 'rough')
    changed = index([drives], catalogue)
    assert inside == [str(drives / 'b' / 'rough')]
    assert (changed.read, changed.unchanged) == (1, 2)
    assert row_of(changed.recordings, 'b/rough')['whole'] is True
    assert 'a/gap' not in changed.recordings['recording'].to_pylist()


def test_each_mount_of_a_car_has_a_row_with_the_work_of_its_pads(tmp_path):
    from engine_mount.fleet.example import make_one, whole_fleet

    (order,) = [
        order for order in whole_fleet(tmp_path, 1.0) if order.folder.match('bench_8_hz/*_two_mounts')
    ]
    made = make_one(order)
    rows = rows_of(made, next(iter(places([str(made)]).values())))
    recordings, events = rows['recordings'], rows['events']
    assert [row['mount'] for row in recordings] == ['left', 'right']
    assert {row['simulated_mount'] for row in recordings} == {'left,right'}
    assert {row['mount'] for row in events} == {'left', 'right'}
    assert all(row['switched_on'] == 1 for row in recordings)
    truth = engine_mount.open(made)['/left/sim/truth']
    work = 1e-3 * np.abs(truth['friction_force'] * truth['velocity']).sum()
    assert recordings[0]['pad_energy_j'] == pytest.approx(work, rel=0.1)


def test_a_copy_elsewhere_has_the_same_row_but_for_its_address(drives, tmp_path):
    """As a store's copy has: no sentence tells where it lay on this machine."""
    for recording in ('b/rough', 'garbage.mcap'):
        place = next(iter(places([str(drives / recording)]).values()))
        copy = tmp_path / 'cache' / Path(recording).name
        copy.parent.mkdir(exist_ok=True)
        if copy.suffix:
            shutil.copy(drives / recording, copy)
        else:
            shutil.copytree(drives / recording, copy)
        assert rows_of(copy, place) == rows_of(drives / recording, place)


def test_pieces_of_one_recording_are_one_place_and_files_of_their_own_are_several(tmp_path):
    for name in ('run/run_0.mcap', 'run/run_1.mcap', 'loose/a.mcap', 'loose/b.mcap', 'described/x.mcap'):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b'')
    (tmp_path / 'described' / 'metadata.yaml').write_text('')
    (tmp_path / 'described' / 'y.mcap').write_text('')
    found = places([str(tmp_path)])
    assert [place.recording for place in found.values()] == [
        'described',
        'loose/a.mcap',
        'loose/b.mcap',
        'run',
    ]
    before = found[str(tmp_path / 'run')].fingerprint
    os.utime(tmp_path / 'run' / 'run_1.mcap', (1.0, 1.0))
    assert places([str(tmp_path / 'run')])[str(tmp_path / 'run')].fingerprint != before


def test_a_foreign_file_is_refused_with_the_command_that_imports_it(tmp_path):
    (tmp_path / 'rack.csv').write_text('t,x\n0,1\n')
    assert places([str(tmp_path)]) == {}
    with pytest.raises(SourceError, match=r'no recording .* engine-mount import makes one'):
        places([str(tmp_path / 'rack.csv')])


def test_a_place_is_the_same_from_wherever_it_is_named(drives, monkeypatch):
    whole = places([str(drives)])
    assert whole[str(drives / 'a' / 'gap')].recording == 'a/gap'
    monkeypatch.chdir(drives)
    assert places(['.']) == places([f'../{drives.name}/']) == places([f'file://{drives}']) == whole


def test_a_journal_of_other_columns_is_not_taken(drives, tmp_path, inside):
    index([drives], tmp_path / 'catalogue')
    journal = tmp_path / 'catalogue' / 'journal.jsonl'
    journal.write_text(journal.read_text().replace('"mode"', '"modus"', 1))
    assert index([drives], tmp_path / 'catalogue').read == 4
