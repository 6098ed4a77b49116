"""The end of a process, as a supervisor sees it."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from ros_testing import LIMIT, free_domain

from mount_ros.nodes.process import environment_of_children

PROGRAM = """
import os, threading
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.process import run_nodes
from mount_ros.topics import DISPLACEMENT

def say(node, what):
    os.write(1, f'{{node.get_name()}} {{what}}\\n'.encode())  # whole lines, whichever threads speak at once

class Probe(SafeLifecycleNode):
    def __init__(self):
        super().__init__(next(names))
        {in_creation}
        self.create_timer(0.01, self._first_turn)
        self.trigger_configure()
        self.trigger_activate()
    def configure(self):
        path = self.open_data_path()
        path.subscribe(DISPLACEMENT, lambda raw: None)
        path.start()
    def deactivate(self):
        say(self, 'deactivate')
        {at_the_end}
    def cleanup(self):
        say(self, 'cleanup')
    def _first_turn(self):
        if not hasattr(self, 'served'):
            self.served = True
            say(self, 'served')
        {in_service}

names = iter(['one', 'two'])
run_nodes([Probe] * {count})
print('over', flush=True)
"""


class Process:
    """A process with some nodes; `lines` are what it has said."""

    def __init__(
        self, domain, count, in_service='pass', at_the_end='pass', in_creation='pass', environment=None
    ):
        program = PROGRAM.format(
            count=count, in_service=in_service, at_the_end=at_the_end, in_creation=in_creation
        )
        self._process = subprocess.Popen(
            [sys.executable, '-c', program],
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain), **(environment or {})},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines = []

    def wait_for(self, *lines):
        wanted = set(lines)
        limit = threading.Timer(LIMIT, self._process.kill)
        limit.start()
        try:
            for line in self._process.stdout:
                self.lines.append(line.strip())
                if wanted <= set(self.lines):
                    return
        finally:
            limit.cancel()
        pytest.fail(f'{wanted - set(self.lines)} not said; {self._process.stderr.read()}')

    def end(self, number=None, until_the_end=False):
        """Return exit code and errors after a signal, or after nothing if it ends on its own."""
        while until_the_end and self._process.poll() is None:
            self._process.send_signal(number)
            time.sleep(0.001)
        if number is not None:
            self._process.send_signal(number)
        out, errors = self._process.communicate(timeout=LIMIT)
        self.lines += out.splitlines()
        errors = ''.join(line for line in errors.splitlines(keepends=True) if not line.startswith('[INFO]'))
        return self._process.returncode, errors

    def kill(self):
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()


@pytest.fixture
def start():
    started = []
    with free_domain() as domain:
        yield lambda *arguments, **more: started.append(Process(domain, *arguments, **more)) or started[-1]
        for process in started:
            process.kill()


@pytest.mark.parametrize(('number', 'nodes'), [(signal.SIGINT, 2), (signal.SIGTERM, 2), (signal.SIGTERM, 1)])
def test_nodes_of_one_process_are_closed_in_reverse_order_with_exit_code_0(start, number, nodes):
    process = start(nodes)
    names = ['one', 'two'][:nodes]
    process.wait_for(*(f'{name} served' for name in names))
    code, errors = process.end(number)
    assert (code, errors) == (0, '')
    said = [line for line in process.lines if 'served' not in line]
    assert said == [f'{name} {step}' for name in names[::-1] for step in ('deactivate', 'cleanup')] + ['over']


@pytest.mark.parametrize('ends_before', [True, False])
def test_nodes_whose_starter_is_killed_are_closed_and_say_so(start, monkeypatch, ends_before):
    with subprocess.Popen(['sleep', '600']) as starter:
        monkeypatch.setattr(os, 'getpid', lambda: starter.pid)
        environment = environment_of_children(0)
        if ends_before:
            starter.kill()
            starter.wait()
        process = start(1, environment=environment)
        if not ends_before:
            process.wait_for('one served')
        starter.kill()
        code, errors = process.end()
    assert code == 0
    who = f'the process that started this one ({starter.pid})'
    assert errors == f'[ERROR] [one]: {who} has ended, so this one ends too, at 0 A: start the graph again\n'
    assert process.lines[-3:] == ['one deactivate', 'one cleanup', 'over']


def test_signals_until_the_process_has_ended_change_nothing(start):
    """Also those that come while the interpreter ends."""
    process = start(1)
    process.wait_for('one served')
    code, errors = process.end(signal.SIGINT, until_the_end=True)
    assert (code, errors) == (0, '')
    assert process.lines[-3:] == ['one deactivate', 'one cleanup', 'over']


def test_a_signal_that_another_thread_takes_wakes_the_sleeping_main_thread(start):
    kill = 'signal.pthread_kill(threading.get_ident(), signal.SIGTERM)'
    process = start(1, in_creation=f'import signal; threading.Timer(0.5, lambda: {kill}).start()')
    code, errors = process.end()
    assert (code, errors) == (0, '')
    assert process.lines[-3:] == ['one deactivate', 'one cleanup', 'over']


def test_a_step_that_raises_at_the_end_does_not_keep_the_others_from_theirs(start):
    process = start(2, at_the_end="raise ValueError('stuck')")
    process.wait_for('one served', 'two served')
    code, errors = process.end(signal.SIGINT)
    assert code == 0
    assert errors.count('deactivate failed: ValueError: stuck') == 2
    assert process.lines[-1] == 'over'


@pytest.mark.parametrize('name', ['one', 'two'])
def test_an_exception_in_a_node_ends_all_nodes_of_its_process_with_code_1(start, name):
    process = start(
        2, in_service=f"if self.get_name() == '{name}': raise RuntimeError('nobody foresaw this')"
    )
    code, errors = process.end()
    assert code == 1
    assert f'[FATAL] [{name}]: RuntimeError: nobody foresaw this' in errors
    said = [line for line in process.lines if 'served' not in line]
    assert said == ['two deactivate', 'two cleanup', 'one deactivate', 'one cleanup']


def test_the_end_of_the_data_thread_ends_the_process_with_the_reason_and_code_1(start):
    """It is attended work that fails past every border; the nodes are closed as at a signal."""
    collapse = "(lambda: (_ for _ in ()).throw(SystemExit('out of order')))"
    process = start(2, in_service=f"if self.get_name() == 'two': self.data_path.add_poll({collapse})")
    code, errors = process.end()
    assert code == 1
    assert '[FATAL] [two]: the data thread has ended: SystemExit: out of order' in errors
    said = [line for line in process.lines if 'served' not in line]
    assert said == ['two deactivate', 'two cleanup', 'one deactivate', 'one cleanup']


CONTROLLED = """
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.process import run_node

class Probe(SafeLifecycleNode):
    def __init__(self):
        super().__init__('probe')
        self.declare_parameter('limit', 1.0)

run_node(Probe)
"""


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        (['-p', 'limit:=high'], "[FATAL] [-c]: Trying to set parameter 'limit' to 'high' of type"),
        (['-p', 'use_sim_time:=3'], "[FATAL] [-c]: Trying to set parameter 'use_sim_time' to '3'"),
        (['--params-file', 'nowhere.yaml'], "[FATAL] failed to initialize rcl: Couldn't parse params file"),
    ],
)
def test_a_start_with_what_does_not_fit_ends_with_one_sentence_and_code_1(arguments, reason):
    program = [sys.executable, '-c', CONTROLLED, '--ros-args', *arguments]
    with free_domain() as domain:
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
        ended = subprocess.run(program, env=environment, capture_output=True, text=True, timeout=LIMIT)
    assert ended.returncode == 1
    assert reason in ended.stderr
    assert 'Traceback' not in ended.stderr
