"""Other mounts beside a drive: what they do on the same road, to the bit."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import command

from engine_mount.drives.loop.recording import record_core
from engine_mount.recordings.edit import cut
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.session import recorded_session, session_content, session_parameters
from engine_mount.reports.drive.beside import BesideError, mounts_beside
from engine_mount.reports.report import subjects_of
from engine_mount.reports.sections import motion

SHORT = ('--duration', '3', '--set', 'mount_sim.timeline.start=2.8', '--set', 'mount_sim.motorway.gap_time=1')


def driven(folder: Path, *options: str) -> Recording:
    """Return the recording of a drive in core."""
    command('drive', '--core', '--no-report', *options, '--out', folder)
    return open_recording(folder / 'recording')


def parameters_of(recording: Recording) -> dict[str, dict]:
    """Return {node: {parameter: value}} of a recording's session."""
    return session_parameters(session_content(recorded_session(recording)))


@pytest.fixture(scope='module')
def drive(tmp_path_factory) -> Recording:
    """Return a short drive over the gap in the road."""
    return driven(tmp_path_factory.mktemp('beside') / 'drive', *SHORT)


@pytest.mark.parametrize(('name', 'mount'), [('hydromount', 'hydro'), ('no current', 'friction_off')])
def test_each_is_the_drive_of_that_mount_which_has_the_other_one_beside_it(name, mount, drive, tmp_path):
    recording = driven(tmp_path / 'other', *SHORT, '--mount', mount)
    found = mounts_beside(drive, parameters_of(drive))
    for column in ('displacement', 'chassis_acceleration'):
        np.testing.assert_array_equal(found.truths[name][column], recording['sim/truth'][column])
    assert (found.begin - found.stamps[0]) / 1e9 == pytest.approx(2.8)
    assert (
        np.abs(found.truths[name]['displacement']).max() > 1.2 * np.abs(drive['displacement']['mount']).max()
    )
    others = mounts_beside(recording, parameters_of(recording)).truths
    assert {name, *others} == {'hydromount', 'no current'}
    assert len(others) == 1
    ours, own = (
        json.loads((each.path.parent / 'summary.json').read_text())['felt'] for each in (drive, recording)
    )
    assert own[name] | {'coil_w': 0.0} == ours[name]  # its driver opens when the road begins
    assert ours['this mount']['coil_w'] > 0.1
    assert 0.5 < ours['this mount']['wear_j_per_km'] < 50.0


@pytest.mark.parametrize(('gap_time', 'computed'), [(1, ['no current']), (1.3, [])])
def test_recordings_share_the_event_and_the_other_mounts_where_they_share_the_road(
    gap_time, computed, drive, tmp_path
):
    options = '--mount', 'hydro', '--set', f'mount_sim.motorway.gap_time={gap_time}'
    recording = driven(tmp_path / 'hydro', *SHORT, *options)
    subjects = subjects_of([drive, recording])
    displacement, current = motion.traces(subjects).chart.panels
    own = [f'displacement, {each.name}' for each in subjects]
    assert [curve.name for curve in displacement.curves] == [*computed, *reversed(own)]  # the first on top
    assert [curve.name for curve in current.curves] == [f'current, {subjects[0].name}']  # no coil, no current
    for section in (motion.hysteresis(subjects), motion.spectra(subjects)):
        names = [curve.name for curve in section.chart.panels[0].curves]
        assert len(names) == 2 + len(computed)
        assert names[: len(computed)] == computed
    assert len(motion.hysteresis(subjects).words) == 2 - len(computed)  # one event, or one of each


def test_the_report_on_a_drive_in_real_time_has_the_other_mounts_and_the_isolation(drive, tmp_path):
    # In real time the electronics sample on until the graph ends: `sim/truth` is longer than the run.
    longer = parameters_of(drive)
    longer['mount_sim']['timeline.duration'] += 0.033
    record_core(tmp_path / 'recording', longer, recorded_session(drive))
    recording = open_recording(tmp_path / 'recording')
    assert len(recording['sim/truth']) == len(drive['sim/truth']) + 33
    page = tmp_path / 'page.html'
    command('report', tmp_path / 'recording', '--out', page)
    html = page.read_text(encoding='utf-8')
    assert '"name":"hydromount"' in html
    words = ' '.join(re.sub('<[^>]*>', ' ', html).split())
    assert re.search(
        r'Isolation \(good\) peak displacement \S+ mm, better by \d+ % than hydromount \(\S+ mm\)', words
    )


def test_of_a_part_of_a_drive_it_is_the_same_part(drive, tmp_path):
    cut(drive, tmp_path / 'part', 3.5, 4.5)
    part = open_recording(tmp_path / 'part')
    whole, of_part = (mounts_beside(each, parameters_of(drive)) for each in (drive, part))
    inside = np.isin(whole.stamps, of_part.stamps)
    assert 900 < inside.sum() < 1100
    for name, truth in of_part.truths.items():
        np.testing.assert_array_equal(truth, whole.truths[name][inside])
    assert of_part.begin == whole.begin


def test_what_another_road_gave_is_not_told_of_this_drive(drive):
    parameters = parameters_of(drive)
    other = {**parameters, 'mount_sim': {**parameters['mount_sim'], 'seed': 2}}
    with pytest.raises(BesideError, match='is not that of the session'):
        mounts_beside(drive, other)


@pytest.mark.parametrize(
    ('changed', 'reason'),
    [
        ({'scenario': 'bench'}, 'a rack imposes the displacement'),
        ({'timeline.duration': 301.0}, 'for runs of up to 300 s'),
        ({'mounts': 'left,right'}, 'with several mounts it is not computed'),
        ({'scenario': 'recorded'}, 'cannot be computed again: scenario recorded needs a file'),
    ],
)
def test_where_it_cannot_be_told_a_sentence_says_why(drive, changed, reason):
    parameters = parameters_of(drive)
    with pytest.raises(BesideError, match=reason):
        mounts_beside(drive, {**parameters, 'mount_sim': {**parameters['mount_sim'], **changed}})
