"""What the processes of the graph are given besides their parameters."""

import time

import pytest

from mount_bringup.graph import processes
from mount_bringup.graph.nodes import CONTROL, RECORDER, GraphSettings
from mount_ros.testing import LIMIT

TELL = 'from mount_ros.nodes.starter import given_priority; print(given_priority())'


@pytest.mark.parametrize(
    ('node', 'priority', 'told'),
    [(CONTROL, 10, '10'), (CONTROL, 0, '0'), (RECORDER, 10, '5'), (RECORDER, 1, '1'), (RECORDER, 0, '0')],
)
def test_the_loop_is_given_the_priority_and_the_recorder_one_behind_it(
    tmp_path, monkeypatch, node, priority, told
):
    monkeypatch.setattr(processes, '_program', lambda *_: TELL)
    settings = GraphSettings(priority=priority)
    process = processes.NodeProcess([node], settings, tmp_path)
    assert process.wait() == 0
    assert process.log_file.read_text().strip() == told


def test_modules_in_the_working_directory_are_not_imported(tmp_path, monkeypatch):
    for module in ('yaml', 'queue'):
        (tmp_path / f'{module}.py').write_text('raise SystemExit("foreign code ran")')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(processes, '_program', lambda *_: 'import queue, yaml')
    process = processes.NodeProcess([CONTROL], GraphSettings(), tmp_path)
    assert process.wait() == 0, process.last_words()


@pytest.fixture
def held(tmp_path, monkeypatch):
    """Return a process that has loaded a module of its own and makes no node yet."""
    (tmp_path / 'loaded.py').write_text('print("loaded", flush=True)\ndef run_nodes(classes): print("begun")')
    program = processes._program([CONTROL], '')
    for module in ('mount_ros.nodes.process', 'mount_control.node'):
        program = program.replace(module, 'loaded')
    monkeypatch.setattr(
        processes,
        '_program',
        lambda *_: f'MountControl = 0; {program}'.replace('from loaded import MountControl', 'import loaded'),
    )
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    process = processes.NodeProcess([CONTROL], GraphSettings(), tmp_path)
    end = time.monotonic() + LIMIT
    while 'loaded' not in process.log_file.read_text():
        assert time.monotonic() < end, process.log_file.read_text()
        time.sleep(0.01)
    return process


def test_a_process_loads_at_once_and_makes_its_nodes_when_told_to(held):
    assert held.exit_code is None
    held.begin()
    assert held.wait() == 0
    assert held.log_file.read_text() == 'loaded\nbegun\n'


def test_a_process_that_has_made_nothing_yet_is_ended_without_a_complaint(held):
    assert processes.end_all([held]) == []
    assert held.exit_code is not None


@pytest.mark.parametrize('at_once', [True, False])
def test_processes_are_asked_to_end_last_started_first_each_once(at_once):
    told = []

    class Told:
        exit_code = None
        begun = True

        def __init__(self, name):
            self.name = name

        def ask_to_end(self):
            told.append(f'ask {self.name}')

        def wait(self):
            told.append(f'wait {self.name}')
            return 0

    assert processes.end_all([Told('a'), Told('b')], at_once=at_once) == []
    in_turn = ['ask b', 'wait b', 'ask a', 'wait a']
    assert told == (['ask b', 'ask a', 'wait b', 'wait a'] if at_once else in_turn)
