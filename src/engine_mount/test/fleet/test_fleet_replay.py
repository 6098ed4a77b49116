"""Many recordings, as recorded and with a change: the same table however it comes about."""

import math
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import parsed_changes
from engine_mount.fleet.job import OrderError
from engine_mount.fleet.what_if import one, run
from engine_mount.fleet.what_if.asked import AskedError, recordings_asked
from engine_mount.fleet.what_if.closed_loop import both_motions, compared_motion
from engine_mount.fleet.what_if.compared import compared_setpoints, recorded_in
from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet
from engine_mount.recordings.cut import cut
from engine_mount.recordings.place import open_run
from engine_mount.settings.options import with_sample_rate
from engine_mount.signals.sources.source import SourceError
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_text

REFERENCES = Path(__file__).resolve().parents[4] / 'bags' / 'reference'
CHANGES = parsed_changes({'highest_current': 0.7})
NAMES = ['gap', 'opening', 'rough']


@pytest.fixture
def fleet(tmp_path):
    """A folder with three recordings and one that is damaged."""
    folder = tmp_path / 'fleet'
    for name in NAMES:
        shutil.copytree(REFERENCES / name, folder / name)
    (folder / 'broken.mcap').write_bytes(b'not a recording')
    return folder


def order_of(fleet):
    return FleetOrder([str(fleet)], CHANGES)


@pytest.fixture(scope='module')
def driven(tmp_path_factory):
    """A drive over a gap with all its traces."""
    folder = tmp_path_factory.mktemp('driven') / 'recording'
    parameters = {'mount_sim': {'scenario': 'motorway', 'timeline.duration': 5.0}}
    record_core(folder, parameters, session_text({'parameters': parameters}))
    return folder


def test_what_can_be_made_again_is_written_in_long_chunks(driven, tmp_path):
    cut(open_run(driven), tmp_path / 'piece', 1.0, 4.0)
    for folder in (driven, tmp_path / 'piece'):
        chunks = open_run(folder).files[0].chunks
        assert max(chunk.size for chunk in chunks) >= LONG_CHUNK_SIZE


def test_the_changed_level_shows_in_the_row_and_the_replay_as_recorded_is_what_was_recorded():
    row = compared_setpoints(recorded_in(open_run(REFERENCES / 'opening')), CHANGES)
    assert row['as_recorded'] is True
    assert row['peak_current_a'] > row['peak_current_changed_a'] == 0.7
    assert row['setpoints_differing'] > 0
    assert row['setpoint_difference_largest_a'] == pytest.approx(0.7 - row['peak_current_a'], abs=0.05)
    assert 0.0 < row['pad_energy_changed_j'] < row['pad_energy_j']


def test_a_closed_loop_tells_how_both_motions_differ_at_whatever_rate(tmp_path):
    sim = {'scenario': 'motorway', 'timeline.duration': 2.0}
    parameters = with_sample_rate({'mount_sim': sim}, 500.0)
    record_core(tmp_path / 'recording', parameters, session_text({'parameters': parameters}))
    recorded = recorded_in(open_run(tmp_path / 'recording'))
    row = compared_motion(recorded, CHANGES)
    assert row['samples'] == 500.0 * row['duration_s']
    first, other = both_motions(recorded, CHANGES)
    assert row['peak_displacement_m'] == np.abs(first.displacement).max()
    assert row['peak_displacement_changed_m'] == np.abs(other.displacement).max()
    difference = other.displacement - first.displacement
    place = int(np.argmax(np.abs(difference)))
    assert row['displacement_difference_largest_m'] == difference[place] != 0.0
    assert row['displacement_difference_largest_at_s'] == pytest.approx(first.time[place])
    assert row['displacement_difference_rms_m'] == pytest.approx(np.sqrt(np.mean(difference**2)))
    assert np.diff(first.time) == pytest.approx(0.002)
    assert np.array_equal(first.acceleration, other.acceleration)


def test_without_an_effect_nothing_differs():
    row = compared_setpoints(
        recorded_in(open_run(REFERENCES / 'gap')), parsed_changes({'longest_bridge': 0.03})
    )
    assert row['setpoints_differing'] == row['switchings_moved'] == row['switchings_appeared'] == 0
    assert math.isnan(row['setpoint_difference_first_at_s'])


def test_a_damaged_recording_is_a_row_with_its_reason(fleet, tmp_path, inside):
    table = replay_fleet(order_of(fleet), tmp_path / 'result').table.to_pylist()
    assert [row['recording'] for row in table] == ['broken.mcap', *NAMES]
    assert [bool(row['reason']) for row in table] == [True, False, False, False]
    assert str(tmp_path) not in table[0]['reason']


def test_a_recording_with_another_policy_is_told_apart_from_one_that_failed(fleet, tmp_path, inside):
    changes = parsed_changes({'continuous_viscous.full_amplitude': 0.0006})
    outcome = replay_fleet(FleetOrder([str(fleet)], changes), tmp_path / 'result')
    rows = outcome.table.to_pylist()
    assert [row['outcome'] for row in rows] == ['failed', 'another policy', 'replayed', 'another policy']
    assert 'of the policy continuous_viscous would have no effect' in rows[1]['reason']
    assert [bool(row['sha256']) for row in rows] == [True, False, True, False]  # not read through
    figures = outcome.figures()
    names = ('recordings', 'replayed', 'another_policy', 'failed')
    assert [figures[name] for name in names] == [4, 1, 2, 1]


def test_a_recording_of_several_mounts_counts_once_as_failed_before_replayed():
    outcomes = ('another policy', 'replayed', 'failed', 'replayed', 'another policy', 'another policy')
    rows = [{'recording': name, 'outcome': each} for name, each in zip('aabbcc', outcomes, strict=True)]
    assert run._outcomes(rows) == {'another policy': 1, 'replayed': 1, 'failed': 1}


def test_another_order_into_the_same_result_is_refused(fleet, tmp_path, inside):
    replay_fleet(order_of(fleet), tmp_path / 'result')
    other = FleetOrder([str(fleet)], parsed_changes({'highest_current': 0.8}))
    with pytest.raises(OrderError, match=r'another order: changes was .*0\.7.* now it is .*0\.8'):
        replay_fleet(other, tmp_path / 'result')


def test_the_same_order_again_reads_nothing_again(fleet, tmp_path, inside):
    first = replay_fleet(order_of(fleet), tmp_path / 'result')
    content = first.result.read_bytes()
    inside.clear()
    again = replay_fleet(order_of(fleet), tmp_path / 'result')
    assert (inside, again.before, again.figures()['failed']) == ([], 4, 1)
    assert again.result.read_bytes() == content


def test_what_cannot_be_fetched_is_tried_again(fleet, tmp_path, inside, monkeypatch):
    whole = replay_fleet(order_of(fleet), tmp_path / 'whole').result.read_bytes()
    there = one.local_copy

    def away(uri):
        if uri.endswith('opening'):
            raise SourceError('the store does not answer')
        return there(uri)

    monkeypatch.setattr(one, 'local_copy', away)
    first = replay_fleet(order_of(fleet), tmp_path / 'result')
    assert [row['reason'] for row in first.not_fetched] == ['the store does not answer']
    assert first.table.num_rows == 4
    monkeypatch.setattr(one, 'local_copy', there)
    inside.clear()
    again = replay_fleet(order_of(fleet), tmp_path / 'result')
    assert inside == [str(fleet / 'opening')]
    assert again.result.read_bytes() == whole


def test_a_recording_that_changed_is_replayed_again_and_has_its_new_rows_alone(fleet, tmp_path, inside):
    whole = replay_fleet(order_of(fleet), tmp_path / 'result')
    content = whole.result.read_bytes()
    inside.clear()
    os.utime(next((fleet / 'gap').glob('*.mcap')), (1.0, 1.0))  # of the same size
    again = replay_fleet(order_of(fleet), tmp_path / 'result')
    assert (inside, again.before) == ([str(fleet / 'gap')], 3)
    assert again.result.read_bytes() == content


def test_a_recording_that_changed_and_cannot_be_fetched_has_one_row(fleet, tmp_path, inside, monkeypatch):
    replay_fleet(order_of(fleet), tmp_path / 'result')
    os.utime(next((fleet / 'gap').glob('*.mcap')), (1.0, 1.0))
    monkeypatch.setattr(one, 'local_copy', out_of_order)
    again = replay_fleet(order_of(fleet), tmp_path / 'result').table.to_pylist()
    assert [row['recording'] for row in again] == ['broken.mcap', *NAMES]
    assert again[1]['reason'] == 'out of order'


def out_of_order(uri):
    raise SourceError('out of order')


def test_the_same_order_from_another_folder_is_the_same(fleet, tmp_path, inside, monkeypatch):
    replay_fleet(order_of(fleet), tmp_path / 'result')
    inside.clear()
    monkeypatch.chdir(tmp_path)
    assert replay_fleet(FleetOrder(['./fleet/'], CHANGES), tmp_path / 'result').before == 4
    assert inside == []


KILLED = """
import os, signal, sys
from pathlib import Path
from engine_mount.drives.replay import parsed_changes
from engine_mount.fleet import job
from engine_mount.fleet.runner import Done
from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet

def tasks(work, items, **_):
    for place, item in enumerate(items):
        if place == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        yield Done(place, work(item))

job.run_tasks = tasks
replay_fleet(FleetOrder([sys.argv[1]], parsed_changes({'highest_current': 0.7})), Path(sys.argv[2]))
"""


def test_a_command_that_is_killed_goes_on_where_it_was_with_nothing_lost_or_twice(fleet, tmp_path, inside):
    whole = replay_fleet(order_of(fleet), tmp_path / 'whole').result.read_bytes()
    killed = subprocess.run([sys.executable, '-c', KILLED, str(fleet), str(tmp_path / 'result')], check=False)
    assert killed.returncode == -signal.SIGKILL
    with (tmp_path / 'result' / 'journal.jsonl').open('a') as journal:
        journal.write('["a line that the power failure cut of')
    inside.clear()
    again = replay_fleet(order_of(fleet), tmp_path / 'result')
    assert inside == [str(fleet / name) for name in ('opening', 'rough')]
    assert again.before == 2
    assert again.result.read_bytes() == whole


WITH_DASK = """
import os, signal, sys
from pathlib import Path
from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import parsed_changes

def children(process):
    found = []
    for place in Path('/proc').glob('[0-9]*/stat'):
        try:
            parts = place.read_text().rpartition(')')[2].split()
        except OSError:
            continue
        if int(parts[1]) == process and b'spawn_main' in place.with_name('cmdline').read_bytes():
            found.append(int(place.parent.name))
    return found

killed = []

def report(progress):
    if progress.done and not killed:
        killed.append(children(os.getpid())[0])
        os.kill(killed[0], signal.SIGKILL)

if __name__ == '__main__':
    order = FleetOrder([sys.argv[1]], parsed_changes({'highest_current': 0.7}))
    outcome = replay_fleet(order, Path(sys.argv[2]), workers=2, progress=report)
    assert not outcome.not_fetched
    assert killed
    assert outcome.workers <= 2  # a process that takes the place of another is no further one
"""


@pytest.mark.slow
def test_two_workers_of_another_processor_one_of_them_killed_give_the_same_bytes(fleet, tmp_path, inside):
    whole = replay_fleet(order_of(fleet), tmp_path / 'whole').result.read_bytes()
    script = tmp_path / 'with_dask.py'
    script.write_text(WITH_DASK, encoding='utf-8')
    other = {
        'OPENBLAS_CORETYPE': 'Prescott',
        'NPY_DISABLE_CPU_FEATURES': 'AVX2 FMA3 AVX512F AVX512_SKX',
    }
    subprocess.run(
        [sys.executable, str(script), str(fleet), str(tmp_path / 'result')],
        env={**os.environ, **other},
        check=True,
    )
    assert (tmp_path / 'result' / 'result.parquet').read_bytes() == whole


def test_recordings_are_named_by_their_path_below_what_was_asked_for(fleet):
    assert [asked.recording for asked in recordings_asked([str(fleet)])] == ['broken.mcap', *NAMES]
    assert [asked.recording for asked in recordings_asked([str(fleet / 'gap')])] == ['gap']
    with pytest.raises(AskedError, match='no recording at'):
        recordings_asked([str(Path(__file__).parent)])


def same(row, other):
    """Whether two rows are the same to the bit; NaN is itself."""
    return row.keys() == other.keys() and all(
        value == other[name] or (value != value and other[name] != other[name]) for name, value in row.items()
    )
