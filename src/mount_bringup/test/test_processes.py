"""What the processes of the graph are given besides their parameters."""

import pytest
from ros_testing import wait_until

from mount_bringup.graph import processes
from mount_bringup.graph.nodes import CONTROL, DRIVER, RECORDER, GraphSettings

PRIORITY = 'import os; print(os.environ["ENGINE_MOUNT_PRIORITY"])'


@pytest.mark.parametrize(
    ('node', 'priority', 'told'),
    [(CONTROL, 10, '10'), (CONTROL, 0, '0'), (RECORDER, 10, '5'), (RECORDER, 1, '1'), (RECORDER, 0, '0')],
)
def test_the_loop_is_given_the_priority_and_the_recorder_one_behind_it(
    tmp_path, monkeypatch, node, priority, told
):
    monkeypatch.setattr(processes, '_program', lambda *_: PRIORITY)
    settings = GraphSettings(priority=priority)
    process = processes.NodeProcess([node], settings, tmp_path)
    assert process.wait() == 0
    assert process.log_file.read_text().strip() == told


@pytest.mark.parametrize('path', ['', '/nowhere::/elsewhere'])
def test_modules_in_the_working_directory_are_not_imported(tmp_path, monkeypatch, path):
    for module in ('yaml', 'queue'):
        (tmp_path / f'{module}.py').write_text('raise SystemExit("foreign code ran")')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('PYTHONPATH', path)
    monkeypatch.setattr(processes, '_program', lambda *_: 'import queue, yaml')
    process = processes.NodeProcess([CONTROL], GraphSettings(), tmp_path)
    assert process.wait() == 0, process.last_words()


def ended(processes_, *, at_once=False):
    """End processes and return the complaints."""
    return processes.end_processes(processes_, at_once=at_once)


def test_a_process_that_still_loads_is_ended_quietly_and_without_a_complaint(tmp_path, monkeypatch):
    (tmp_path / 'loading.py').write_text('import time; print("up", flush=True); time.sleep(600)')
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    program = processes._program([CONTROL], '').replace('mount_control.node', 'loading')
    process = started(monkeypatch, tmp_path, CONTROL, program)
    assert ended([process]) == []
    assert process.log_file.read_text() == 'up\n'


@pytest.mark.parametrize('at_once', [True, False])
def test_processes_are_interrupted_last_started_first_each_once(at_once):
    done = []

    class Noted:
        exit_code = None
        begun, reported = True, False

        def __init__(self, name):
            self.name = name

        def interrupt(self):
            done.append(f'interrupt {self.name}')

        def wait(self):
            done.append(f'wait {self.name}')
            return 0

    assert ended([Noted('a'), Noted('b')], at_once=at_once) == []
    in_turn = ['interrupt b', 'wait b', 'interrupt a', 'wait a']
    assert done == (['interrupt b', 'interrupt a', 'wait b', 'wait a'] if at_once else in_turn)


STANDING = 'import os, signal; print("up", flush=True); os.kill(os.getpid(), signal.SIGSTOP)'
WRITING = """import pathlib, signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN); signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("up", flush=True)
with pathlib.Path({file!r}).open("ab", buffering=0) as recording:
    for _ in range({count}):
        recording.write(b"x"); time.sleep(0.02)
{then}"""


@pytest.fixture
def impatient(monkeypatch):
    """Limits of tenths of seconds, for processes that are told to end."""
    monkeypatch.setattr(processes, '_INTERRUPT_LIMIT', 0.2)
    monkeypatch.setattr(processes, '_TERMINATE_LIMIT', 0.1)


def started(monkeypatch, folder, node, program, settings=None):
    monkeypatch.setattr(processes, '_program', lambda *_: program)
    process = processes.NodeProcess([node], settings or GraphSettings(), folder)
    wait_until(lambda: 'up' in process.log_file.read_text(), 'the process')
    process.begun = True
    return process


@pytest.mark.usefixtures('impatient')
@pytest.mark.parametrize('at_once', [True, False])
def test_each_frozen_process_is_killed_and_named(tmp_path, monkeypatch, at_once):
    frozen = [started(monkeypatch, tmp_path, node, STANDING) for node in (DRIVER, CONTROL)]
    told = ended(frozen, at_once=at_once)
    assert [sentence.split(':')[0] for sentence in told] == [
        'mount_control ended with code -9',
        'mount_driver ended with code -9',
    ]
    assert [process.exit_code for process in frozen] == [-9, -9]


@pytest.mark.parametrize(('then', 'code'), [('', 0), ('time.sleep(600)', -9)])
def test_a_recorder_is_given_time_while_its_recording_grows_and_no_longer(tmp_path, monkeypatch, then, code):
    # Limits that a busy machine keeps, and a recording that takes longer than both together.
    monkeypatch.setattr(processes, '_INTERRUPT_LIMIT', 1.0)
    monkeypatch.setattr(processes, '_TERMINATE_LIMIT', 0.5)
    file = tmp_path / 'run' / 'part_0.mcap'
    file.parent.mkdir()
    program = WRITING.format(count=100, file=str(file), then=then)
    settings = GraphSettings(parameters={RECORDER.name: {'uri': str(tmp_path / 'run')}})
    recorder = started(monkeypatch, tmp_path, RECORDER, program, settings)
    told = ended([recorder])
    assert recorder.exit_code == code
    assert len(file.read_text()) == 100
    assert bool(told) == bool(code)


def test_a_process_that_died_before_the_end_is_told_once(tmp_path, monkeypatch):
    dead = [started(monkeypatch, tmp_path, node, 'print("up"); exit(3)') for node in (DRIVER, CONTROL)]
    wait_until(lambda: all(process.exit_code is not None for process in dead), 'their ends')
    dead[1].reported = True
    told = f'mount_driver ended with code 3: up (log: {dead[0].log_file})'
    assert ended(dead) == [told]
