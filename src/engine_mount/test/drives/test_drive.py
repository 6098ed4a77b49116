"""A drive as a call, and what it says of its recorder."""

import io
from types import SimpleNamespace

import numpy as np
import pytest

import engine_mount
from engine_mount.drives import graph_drive
from engine_mount.drives.drive import CombinationError, drive
from engine_mount.drives.external_excitation import recorded_acceleration
from engine_mount.recordings.screen import Screen
from mount_bringup.graph.nodes import CONTROL, RECORDER, GraphError
from mount_models.quantity import ParameterError

SENTENCE = 'the run goes on without recording: no space left'
SHORT = {'mount_sim': {'timeline.start': 2.8}}


class Graph:
    """A graph whose recorder has failed, looked at a thousand times until the simulator has finished."""

    def __init__(self, nodes, settings, logs):
        self.settings, self.notes, self.nodes, self.finished = settings, [], (CONTROL,), True
        self.reports, self.recovery = SimpleNamespace(), SimpleNamespace(restarts=[])

    def start(self, session, status):
        pass

    def client(self, kind, service):
        pass

    def interrupt(self):
        pass

    def wait_until(self, condition, limit, what):
        for _ in range(1000):
            condition()

    def figures(self, node):
        if node is RECORDER:
            return {'failed': 'True', 'fatal': 'False', 'sentence': SENTENCE}
        if node is CONTROL:
            return {'faults': '2'}
        figures = ('samples', 'excitation_start_s', 'real_time_factor', 'latency_median_s', 'latency_p99_s')
        return {**dict.fromkeys(figures, '1'), 'beyond_range': '3', 'first_beyond_range_s': '0.5'}

    def stop(self):
        return ['mount_sim was killed']


@pytest.mark.parametrize('lockstep', [False, True])
def test_a_drive_that_goes_on_without_its_recording_says_so_once(tmp_path, monkeypatch, domain, lockstep):
    monkeypatch.setattr(graph_drive, 'Supervisor', Graph)
    shown = io.StringIO()
    driven = drive(lockstep=lockstep, domain=domain, out=tmp_path / 'run', screen=Screen(shown))
    assert shown.getvalue().count('goes on without recording') == 1
    beyond, faults, end = driven.complaints
    assert 'beyond' in beyond
    assert '(times: 2)' in faults
    assert end == 'mount_sim was killed'


def test_a_drive_in_core_needs_no_node_and_returns_figures_and_recording(tmp_path):
    driven = drive(core=True, scenario='bench', duration=0.3, parameters=SHORT, out=tmp_path / 'run')
    assert (driven.samples, driven.complaints) == (3100, [])
    assert driven.excitation_start == pytest.approx(2.8)
    assert len(engine_mount.open(driven.recording)['displacement']) == driven.samples
    assert driven.sentences()[-1] == f'recording {tmp_path / "run" / "recording"}'


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        ({'core': True, 'lockstep': True}, 'not both'),
        ({'apart': True}, '--apart goes with --lockstep'),
        ({'core': True, 'composed': True}, '--composed is for real time'),
    ],
)
def test_what_does_not_go_together_is_refused_and_no_folder_made(tmp_path, arguments, reason):
    with pytest.raises(CombinationError, match=reason):
        drive(out=tmp_path / 'run', **arguments)
    with pytest.raises(ParameterError, match='motorwy'):
        drive(out=tmp_path / 'run', core=True, scenario='motorwy')
    assert not (tmp_path / 'run').exists()


def test_a_file_is_the_scenario_and_another_one_beside_it_is_refused(tmp_path):
    times = np.arange(300) / 100.0
    rows = np.column_stack([times, 0.3 * np.sin(12.0 * times)])
    np.savetxt(tmp_path / 'drive.csv', rows, '%.9g', delimiter=',', header='t,az', comments='')
    excitation = recorded_acceleration(str(tmp_path / 'drive.csv'), ['az:m/s^2'])
    driven = drive(core=True, excitation=excitation, parameters=SHORT, out=tmp_path / 'run')
    session = engine_mount.open(driven.recording).latched('session').data
    assert driven.scenario == 'recorded'
    assert 'scenario: recorded' in session
    assert 'file: given/' in session
    with pytest.raises(CombinationError, match='leave out --scenario motorway, or the file'):
        drive(core=True, scenario='motorway', excitation=excitation)


def test_the_bar_begins_at_0_whatever_was_measured_before_and_ends_at_1():
    def report(samples: int) -> dict[str, str]:
        return {'samples': str(samples), 'samples_of_run': '5000'}

    shares = [graph_drive._share(report(3000), report(now)) for now in (3000, 4000, 5000)]
    assert shares == [0.0, 0.5, 1.0]
    assert graph_drive._share(report(5000), report(5000)) == graph_drive._share({}, {'samples': '1'}) == 1.0


@pytest.mark.parametrize(
    ('end', 'raised'), [(KeyboardInterrupt, KeyboardInterrupt), (ValueError, GraphError)]
)
def test_a_drive_that_ends_early_names_its_recording_and_is_no_wrong_use(tmp_path, monkeypatch, end, raised):
    def record(folder, *_, **options):
        folder.mkdir()
        raise end

    monkeypatch.setattr('engine_mount.drives.drive.record_core', record)
    shown = io.StringIO()
    with pytest.raises(raised):
        drive(core=True, out=tmp_path / 'run', screen=Screen(shown))
    assert shown.getvalue() == f'recording  {tmp_path}/run/recording\n'
