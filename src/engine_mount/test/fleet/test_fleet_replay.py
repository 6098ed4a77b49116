"""Many recordings, as recorded and with a change: the same table however it comes about."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from references import REFERENCES_FOLDER

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import parsed_changes
from engine_mount.fleet import job, setpoints
from engine_mount.fleet.closed_loop import compare_motion
from engine_mount.fleet.job import OrderError
from engine_mount.fleet.places import SelectionError, select_recordings
from engine_mount.fleet.replay import count_outcomes, replay_fleet
from engine_mount.fleet.setpoints import compare_setpoints, recorded_in
from engine_mount.recordings.recording import open_run
from engine_mount.settings.options import with_sample_rate
from engine_mount.signals.sources.uris import SourceError
from mount_recorder.session import session_text

CHANGES = parsed_changes({'highest_current': 0.7})
NAMES = ['gap', 'opening', 'rough']


@pytest.fixture
def fleet(tmp_path):
    """A folder with three recordings and one that is damaged."""
    folder = tmp_path / 'fleet'
    for name in NAMES:
        shutil.copytree(REFERENCES_FOLDER / name, folder / name)
    (folder / 'broken.mcap').write_bytes(b'not a recording')
    return folder


def replayed(fleet, out, changes=CHANGES):
    return replay_fleet([str(fleet)], changes, out)


def table_in(folder):
    return (folder / 'result.parquet').read_bytes()


@pytest.fixture
def whole(fleet, tmp_path, inside):
    """The bytes of the table of a run that nothing ended."""
    replayed(fleet, tmp_path / 'whole')
    inside.clear()
    return table_in(tmp_path / 'whole')


@pytest.fixture(scope='module')
def driven(tmp_path_factory):
    """A drive over a gap with all its traces."""
    folder = tmp_path_factory.mktemp('driven') / 'recording'
    parameters = {'mount_sim': {'scenario': 'motorway', 'timeline.duration': 5.0}}
    record_core(folder, parameters, session_text({'parameters': parameters}))
    return folder


@pytest.mark.parametrize('length', [700, 1500])
def test_figures_do_not_depend_on_how_many_samples_are_answered_at_once(driven, length, monkeypatch):
    found = []
    for at_once in (1_000_000, length):
        monkeypatch.setattr(setpoints, '_AT_ONCE', at_once)
        found.append(compare_setpoints(recorded_in(open_run(driven)), CHANGES).row)
    assert found[0]['samples'] > 3 * length
    assert repr(found[0]) == repr(found[1])


def test_the_changed_level_shows_in_the_row_and_the_replay_as_recorded_is_what_was_recorded():
    row = compare_setpoints(recorded_in(open_run(REFERENCES_FOLDER / 'opening')), CHANGES).row
    assert row['as_recorded'] is True
    assert row['peak_current_a'] > row['peak_current_changed_a'] == 0.7
    assert row['setpoints_differing'] > 0
    assert row['setpoint_difference_largest_a'] == pytest.approx(0.7 - row['peak_current_a'], abs=0.05)
    assert 0.0 < row['pad_energy_changed_j'] < row['pad_energy_j']


def test_a_closed_loop_tells_how_both_motions_differ_at_whatever_rate(tmp_path):
    sim = {'scenario': 'motorway', 'timeline.duration': 2.0}
    parameters = with_sample_rate({'mount_sim': sim}, 500.0)
    record_core(tmp_path / 'recording', parameters, session_text({'parameters': parameters}))
    row, signals = compare_motion(recorded_in(open_run(tmp_path / 'recording')), CHANGES)
    assert row['samples'] == 500.0 * row['duration_s']
    first, other = signals.displacements
    assert row['peak_displacement_m'] == np.abs(first).max()
    assert row['peak_displacement_changed_m'] == np.abs(other).max()
    difference = other - first
    place = int(np.argmax(np.abs(difference)))
    assert row['displacement_difference_largest_m'] == difference[place] != 0.0
    assert row['displacement_difference_largest_at_s'] == pytest.approx(signals.time[place])
    assert row['displacement_difference_rms_m'] == pytest.approx(np.sqrt(np.mean(difference**2)))
    assert np.diff(signals.time) == pytest.approx(0.002)


def test_without_an_effect_nothing_differs():
    changes = parsed_changes({'longest_bridge': 0.03})
    row = compare_setpoints(recorded_in(open_run(REFERENCES_FOLDER / 'gap')), changes).row
    assert row['setpoints_differing'] == row['switchings_moved'] == row['switchings_appeared'] == 0
    assert math.isnan(row['setpoint_difference_first_at_s'])


def test_a_damaged_recording_is_a_row_with_its_reason(fleet, tmp_path, inside):
    table = replayed(fleet, tmp_path / 'result').table.to_pylist()
    assert [row['recording'] for row in table] == ['broken.mcap', *NAMES]
    assert [bool(row['reason']) for row in table] == [True, False, False, False]
    assert str(tmp_path) not in table[0]['reason']


def test_a_recording_with_another_policy_is_told_apart_from_one_that_failed(fleet, tmp_path, inside):
    changes = parsed_changes({'continuous_viscous.half_amplitude': 0.00024})
    done = replayed(fleet, tmp_path / 'result', changes)
    rows = done.table.to_pylist()
    assert [row['outcome'] for row in rows] == ['failed', 'another policy', 'replayed', 'another policy']
    assert 'of the policy continuous_viscous would have no effect' in rows[1]['reason']
    assert [bool(row['sha256']) for row in rows] == [True, False, True, False]  # not read through
    names = ('recordings', 'replayed', 'another_policy', 'failed')
    assert [done.figures[name] for name in names] == [4, 1, 2, 1]


def test_a_recording_of_several_mounts_counts_once_as_failed_before_replayed():
    outcomes = ('another policy', 'replayed', 'failed', 'replayed', 'another policy', 'another policy')
    rows = [{'recording': name, 'outcome': each} for name, each in zip('aabbcc', outcomes, strict=True)]
    assert count_outcomes(rows) == {'another policy': 1, 'replayed': 1, 'failed': 1}


def test_another_order_into_the_same_result_is_refused(fleet, tmp_path, inside):
    replayed(fleet, tmp_path / 'result')
    with pytest.raises(OrderError, match=r'another order: changes was .*0\.7.* now it is .*0\.8'):
        replayed(fleet, tmp_path / 'result', parsed_changes({'highest_current': 0.8}))


def test_the_same_order_again_from_another_folder_reads_nothing_again(fleet, tmp_path, inside, monkeypatch):
    replayed(fleet, tmp_path / 'result')
    content = table_in(tmp_path / 'result')
    inside.clear()
    monkeypatch.chdir(tmp_path)
    again = replayed('./fleet/', tmp_path / 'result')
    assert (inside, again.figures['done_before'], again.figures['failed']) == ([], 4, 1)
    assert table_in(tmp_path / 'result') == content


def test_what_cannot_be_fetched_is_tried_again(fleet, whole, tmp_path, inside, monkeypatch):
    there = job.local_copy

    def away(uri):
        if uri.endswith('opening'):
            raise SourceError('the store does not answer')
        return there(uri)

    with monkeypatch.context() as patch:
        patch.setattr(job, 'local_copy', away)
        first = replayed(fleet, tmp_path / 'result')
    assert [row['reason'] for row in first.not_fetched] == ['the store does not answer']
    assert first.table.num_rows == 4
    inside.clear()
    replayed(fleet, tmp_path / 'result')
    assert inside == [str(fleet / 'opening')]
    assert table_in(tmp_path / 'result') == whole


def test_a_run_that_was_killed_goes_on_with_nothing_lost_or_twice(fleet, whole, tmp_path, inside):
    shutil.copytree(tmp_path / 'whole', tmp_path / 'result')
    (tmp_path / 'result' / 'result.parquet').unlink()
    journal = tmp_path / 'result' / 'journal.jsonl'
    done = ''.join(journal.read_text().splitlines(keepends=True)[:3])  # the columns and two recordings
    journal.write_text(f'{done}["a line that the power failure cut of')
    again = replayed(fleet, tmp_path / 'result')
    assert inside == [str(fleet / name) for name in ('opening', 'rough')]
    assert again.figures['done_before'] == 2
    assert table_in(tmp_path / 'result') == whole


WITH_WORKERS = """
import multiprocessing, sys
from pathlib import Path
from engine_mount.fleet.replay import replay_fleet
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import parsed_changes

killed = []

def report(done, of):
    if done and not killed:
        killed.append(multiprocessing.active_children()[0])
        killed[0].kill()

if __name__ == '__main__':
    changes = parsed_changes({'highest_current': 0.7})
    done = replay_fleet([sys.argv[1]], changes, Path(sys.argv[2]), progress=report, workers=2)
    assert not done.not_fetched
    assert killed
"""


@pytest.mark.slow
def test_two_workers_of_another_processor_one_of_them_killed_give_the_same_bytes(fleet, whole, tmp_path):
    script = tmp_path / 'with_workers.py'
    script.write_text(WITH_WORKERS, encoding='utf-8')
    other = {
        'OPENBLAS_CORETYPE': 'Prescott',
        'NPY_DISABLE_CPU_FEATURES': 'AVX2 FMA3 AVX512F AVX512_SKX',
    }
    subprocess.run(
        [sys.executable, str(script), str(fleet), str(tmp_path / 'result')],
        env={**os.environ, **other},
        check=True,
    )
    assert table_in(tmp_path / 'result') == whole


def test_recordings_are_named_by_their_path_below_what_was_asked_for(fleet):
    assert [place.recording for place in select_recordings([str(fleet)])] == ['broken.mcap', *NAMES]
    assert [place.recording for place in select_recordings([str(fleet / 'gap')])] == ['gap']
    with pytest.raises(SelectionError, match='no recording at'):
        select_recordings([str(Path(__file__).parent)])


def test_names_that_mean_two_recordings_are_refused(fleet, tmp_path):
    shutil.copytree(fleet / 'gap', tmp_path / 'other' / 'gap')
    with pytest.raises(SelectionError, match='gap means two recordings'):
        select_recordings([str(fleet), str(tmp_path / 'other')])
