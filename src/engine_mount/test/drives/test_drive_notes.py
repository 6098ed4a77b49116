"""What a drive says of its recorder, without the graph."""

import io
from types import SimpleNamespace

import pytest

from engine_mount.drives import drive
from engine_mount.drives.drive import DriveOrder
from engine_mount.recordings.screen import Screen
from engine_mount.settings.run_folder import make_run_folder
from mount_bringup.graph.nodes import CONTROL, RECORDER
from mount_sim.excitation.excitation import Excitation, Seat

SENTENCE = 'the run goes on without recording: no space left'


class Graph:
    """A graph whose recorder has failed, looked at a thousand times until the simulator has finished."""

    def __init__(self, *_):
        self.notes, self.nodes, self.finished = [], (CONTROL,), True
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
            return {}
        figures = ('samples', 'excitation_start_s', 'real_time_factor', 'latency_median_s', 'latency_p99_s')
        unshaken = {'beyond_range': '0', 'first_beyond_range_s': 'nan'}
        return {**unshaken, **dict.fromkeys(figures, '1')}

    def stop(self):
        return []


@pytest.mark.parametrize('mode', ['real time', 'lock-step'])
def test_a_drive_that_goes_on_without_its_recording_says_so_once(tmp_path, monkeypatch, domain, mode):
    monkeypatch.setattr(drive, 'Supervisor', Graph)
    shown = io.StringIO()
    folder = make_run_folder(tmp_path / 'run', 'bench')
    order = DriveOrder('bench', mode, {}, domain=domain)
    drive._drive_graph(order, Excitation(Seat.BENCH, [], 5e-5, 0.0), folder, Screen(shown), [])
    assert shown.getvalue().count('goes on without recording') == 1
