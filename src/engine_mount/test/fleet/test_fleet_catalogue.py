"""The catalogue: a row for each mount of each recording, whatever is wrong; read again only when changed."""

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import engine_mount
from engine_mount.fleet.catalogue import reading
from engine_mount.fleet.catalogue.columns import BANDS, EVENTS, RECORDINGS, band_name
from engine_mount.fleet.catalogue.in_bands import in_bands
from engine_mount.fleet.catalogue.index import indexed
from engine_mount.fleet.catalogue.places import places
from engine_mount.fleet.catalogue.reading import read_place, rows_at
from engine_mount.fleet.columns import schema_of
from engine_mount.signals.sources.source import SourceError

REFERENCES = Path(__file__).parents[4] / 'bags' / 'reference'


def table_of(places, catalogue, **options):
    return indexed(places, catalogue, **options).recordings


@pytest.fixture
def drives(tmp_path):
    """A folder of recordings: one whole, one cut off, one without its description, and what is none."""
    folder = tmp_path / 'drives'
    for name in ('a/gap', 'b/rough', 'b/initialisation'):
        shutil.copytree(REFERENCES / Path(name).name, folder / name)
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
    table = table_of([drives], tmp_path / 'catalogue')
    assert table.schema.equals(schema_of(RECORDINGS))
    assert table['recording'].to_pylist() == ['a/gap', 'b/initialisation', 'b/rough', 'garbage.mcap']
    gap = row_of(table, 'a/gap')
    assert (gap['kind'], gap['whole'], gap['reason'], gap['scenario']) == ('replay', True, '', 'motorway')
    assert gap['lost_samples'] == gap['faults'] == 0
    assert json.loads(gap['parameters'])['mount_sim.motorway.gap_depth'] == 0.03
    recording = engine_mount.open(REFERENCES / 'gap')
    assert gap['rest_gap_m'] == recording['air_gap']['rest_gap'][-1]
    assert gap['peak_displacement_m'] == np.abs(recording['displacement']['mount']).max()
    assert gap['distance_m'] == pytest.approx(33.0 * gap['duration_s'])
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
    made = indexed([drives], tmp_path / 'catalogue')
    recordings, events = made.recordings, made.events
    assert events.schema.equals(schema_of(EVENTS))
    assert set(events['uri'].to_pylist()) <= set(recordings['uri'].to_pylist())
    gap = [row for row in events.to_pylist() if row['recording'] == 'a/gap']
    assert [row['kind'] for row in gap] == ['switch_on', 'switch_off']
    assert 0.0 < gap[0]['time_s'] < gap[1]['time_s'] < 6.9


def test_only_what_changed_is_read_again_and_what_is_gone_leaves(drives, tmp_path, inside):
    catalogue = tmp_path / 'catalogue'
    table_of([drives], catalogue)
    before = (catalogue / 'recordings.parquet').read_bytes()
    inside.clear()
    again = indexed([drives], catalogue)
    assert inside == []
    assert (again.read, again.unchanged, again.vanished, again.unreadable) == (0, 4, 0, 1)
    assert (catalogue / 'recordings.parquet').read_bytes() == before
    shutil.rmtree(drives / 'a' / 'gap')
    shutil.rmtree(drives / 'b' / 'rough')
    shutil.copytree(REFERENCES / 'opening', drives / 'b' / 'rough')
    changed = indexed([drives], catalogue)
    assert inside == [str(drives / 'b' / 'rough')]
    assert (changed.read, changed.unchanged, changed.vanished) == (1, 2, 1)
    assert row_of(changed.recordings, 'b/rough')['whole'] is True
    assert 'a/gap' not in changed.recordings['recording'].to_pylist()


def test_a_second_place_is_added_to_what_the_catalogue_holds(drives, tmp_path, inside):
    table_of([drives / 'a'], tmp_path / 'catalogue')
    both = indexed([drives / 'b'], tmp_path / 'catalogue')
    assert both.recordings['recording'].to_pylist() == ['gap', 'initialisation', 'rough']
    assert both.vanished == 0


@pytest.mark.slow
def test_rows_are_the_same_from_any_number_of_workers(drives, tmp_path):
    for workers in (1, 2):
        table_of([drives], tmp_path / str(workers), workers=workers)
    for name in ('recordings.parquet', 'events.parquet'):
        assert (tmp_path / '1' / name).read_bytes() == (tmp_path / '2' / name).read_bytes()


def test_an_index_that_was_stopped_goes_on_and_ends_with_the_same_tables(drives, tmp_path, inside):
    whole = table_of([drives], tmp_path / 'whole')
    inside.clear()

    def stop(progress):
        if progress.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        table_of([drives], tmp_path / 'stopped', progress=stop)
    journal = tmp_path / 'stopped' / 'journal.jsonl'
    with journal.open('a') as file:
        file.write('["cut off in the mid')
    done = list(inside)
    inside.clear()
    gone_on = table_of([drives], tmp_path / 'stopped')
    assert (len(done), len(inside), set(done) & set(inside)) == (2, 2, set())
    assert gone_on.equals(whole)


def test_what_could_not_be_fetched_is_tried_again(drives, tmp_path, inside, monkeypatch):
    def away(uri):
        raise SourceError('the store does not answer')

    with monkeypatch.context() as patch:
        patch.setattr(reading, 'local_copy', away)
        row = row_of(table_of([drives / 'a'], tmp_path / 'catalogue'), 'gap')
    assert (row['kind'], row['fingerprint'], row['reason']) == ('unreadable', '', 'the store does not answer')
    again = indexed([drives / 'a'], tmp_path / 'catalogue')
    assert (again.read, again.unreadable) == (1, 0)


@pytest.mark.slow
def test_a_killed_index_leaves_what_can_be_gone_on_with(drives, tmp_path):
    """SIGKILL of the command itself: the same tables in the end as of one that was not stopped."""
    program = f"""
import os, signal
from engine_mount.fleet.catalogue.index import indexed
if __name__ == '__main__':
    indexed([{str(drives)!r}], {str(tmp_path / 'killed')!r}, workers=1,
          progress=lambda now: now.done == 2 and os.kill(os.getpid(), signal.SIGKILL))
"""
    script = tmp_path / 'script.py'
    script.write_text(program)
    assert subprocess.run([sys.executable, str(script)]).returncode == -signal.SIGKILL
    progress = []
    killed = table_of([drives], tmp_path / 'killed', workers=1, progress=progress.append)
    assert progress[0].done == 2
    assert killed.equals(table_of([drives], tmp_path / 'whole', workers=1))


def test_each_mount_of_a_car_has_a_row_with_the_work_of_its_pads(tmp_path):
    from engine_mount.fleet.example.fleet import make_one, whole_fleet

    (order,) = [
        order
        for order in whole_fleet(tmp_path)
        if order.variation.name == 'two_mounts' and order.drive.name == 'bench_8_hz'
    ]
    made = make_one(replace(order, seconds=1.0))
    place = next(iter(places([str(made)]).values()))
    answer = read_place(place)
    recordings, events = answer.rows['recordings'], answer.rows['events']
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
        assert rows_at(copy, place) == rows_at(drives / recording, place)


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


def test_a_place_is_the_same_from_wherever_it_is_named(drives, monkeypatch):
    whole = places([str(drives)])
    assert whole[str(drives / 'a' / 'gap')].recording == 'a/gap'
    monkeypatch.chdir(drives)
    assert places(['.']) == places([f'../{drives.name}/']) == places([f'file://{drives}']) == whole


def test_a_sine_is_in_its_own_band_alone():
    time = np.arange(40_000) * 1e-3
    stamps = np.arange(40_000) * 1_000_000
    values = 1e-3 * np.sin(2 * np.pi * 8.0 * time) + 5e-3
    values[1000:1003] = np.nan
    found = dict(zip(BANDS, in_bands(stamps, values, 1000.0, BANDS), strict=True))
    own = found.pop((3.0, 14.0))
    assert own.rms == pytest.approx(1e-3 / np.sqrt(2), rel=0.01)
    assert own.peak == pytest.approx(1e-3, rel=0.2)
    assert all(other.rms < 2e-5 for other in found.values())


def test_too_short_a_signal_is_in_no_band():
    assert np.isnan(in_bands(np.arange(10) * 1_000_000, np.ones(10), 1000.0, BANDS)).all()


def test_every_column_has_a_meaning_and_what_has_a_unit_says_it():
    names = [column.name for column in RECORDINGS]
    assert len(set(names)) == len(names)
    assert {band_name('peak', band) for band in BANDS} <= set(names)
    assert all(column.meaning for column in (*RECORDINGS, *EVENTS))
    units = {'_m': 'm', '_s': 's', '_a': 'A', '_j': 'J', '_degc': 'degC', '_bytes': 'B', '_ns': 'ns'}
    units |= {'_hz': 'Hz', '_s2': 'm/s^2'}
    for column in (*RECORDINGS, *EVENTS):
        suffix = column.name[column.name.rfind('_') :]
        assert column.unit == units.get(suffix, ''), column.name


def test_a_journal_of_other_columns_is_not_taken(drives, tmp_path, inside):
    table_of([drives], tmp_path / 'catalogue')
    journal = tmp_path / 'catalogue' / 'journal.jsonl'
    journal.write_text(journal.read_text().replace('"mode"', '"modus"', 1))
    assert indexed([drives], tmp_path / 'catalogue').read == 4
