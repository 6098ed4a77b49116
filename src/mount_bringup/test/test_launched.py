"""When the end of a process ends a launched graph as a fault, and what its supervisor says."""

import os
import signal
import subprocess
from types import SimpleNamespace

import pytest

from mount_bringup.graph import launched, siblings
from mount_bringup.graph.errors import GraphError, Interrupted
from mount_bringup.graph.launched import SUPERVISOR, LaunchedGraph, exit_error
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, SIM, SIMULATED, VEHICLE, GraphSettings
from mount_bringup.graph.processes import NODES_OF_PROCESS
from mount_bringup.graph.restarts import Loss, NodesLostError, Remedy, Restart
from mount_ros.testing import wait_until


@pytest.mark.parametrize(
    ('name', 'code', 'asked', 'error'),
    [
        ('mount_control', 0, True, ''),
        ('mount_control', -signal.SIGINT, True, ''),
        ('mount_control', 0, False, 'mount_control ended with code 0'),
        ('mount_control', -9, False, 'mount_control ended with code -9'),
        ('mount_recorder', 1, True, 'mount_recorder ended with code 1'),
        (SUPERVISOR, 0, False, ''),
        (SUPERVISOR, 1, False, 'mount_supervisor ended with code 1, for the reason that it has told'),
        (SUPERVISOR, -9, False, 'mount_supervisor ended with code -9'),
    ],
)
def test_a_process_that_ends_unasked_or_badly_is_a_fault_with_its_name(name, code, asked, error):
    assert exit_error(name, code, asked) == error


class Graph:
    """A graph whose bring-up ends in `outcome`; notes what it is told."""

    notes = ('mount_init refused; it was activated again',)
    restarts = ()
    finished = True

    def __init__(self, outcome=None):
        self.outcome, self.told = outcome, []

    def interrupt(self):
        pass

    def start(self, session, say):
        self.session = session({'mount_control': {'eigenfrequency': 9.0}})
        if self.outcome:
            raise self.outcome

    def wait_until(self, condition, limit, what):
        assert condition()

    def stop(self):
        self.told.append('stop')

    def leave(self):
        self.told.append('leave')


@pytest.mark.parametrize(
    ('outcome', 'code', 'told', 'said'),
    [
        (None, 0, 'stop', 'the end of the drive'),
        (Interrupted(), 0, 'leave', 'activated again'),
        (GraphError('mount_init refused to activate: no ripple'), 1, 'stop', 'to activate: no ripple'),
    ],
)
def test_a_refusal_is_told_and_ends_with_code_1(capfd, outcome, code, told, said):
    graph = Graph(outcome)
    assert launched._supervise(graph, 'car', float('inf')) == code
    assert graph.told == [told]
    assert said in ''.join(capfd.readouterr())
    assert 'eigenfrequency: 9.0' in graph.session
    assert 'versions:' in graph.session


def test_a_drive_in_which_a_node_was_lost_ends_with_code_1_and_tells_it(capfd):
    graph = Graph()
    graph.restarts = (Restart(0, Loss((CONTROL,), 'mount_control has ended'), Remedy.DAMP_ON, 1.5),)
    assert launched._supervise(graph, 'car', float('inf')) == 1
    assert 'mount_control has ended; it is started again' in ''.join(capfd.readouterr())


@pytest.fixture
def child():
    environment = {**os.environ, NODES_OF_PROCESS: 'mount_driver mount_init'}
    process = subprocess.Popen(['sleep', '100'], env=environment)
    yield process
    process.kill()
    process.wait()


def test_a_supervisor_knows_the_processes_of_its_starter_by_their_nodes_and_no_others(child, monkeypatch):
    monkeypatch.setattr(siblings.os, 'getppid', os.getpid)
    wait_until(lambda: siblings.sibling_of([DRIVER, INIT]), 'the environment of the child', 10.0)
    assert siblings.sibling_of([DRIVER]) is None
    sibling = siblings.sibling_of([DRIVER, INIT])
    assert (sibling.pid, sibling.ended) == (child.pid, False)
    monkeypatch.setattr(siblings.os, 'getppid', lambda: 1)
    assert siblings.sibling_of([DRIVER, INIT]) is None
    child.send_signal(signal.SIGSTOP)
    sibling.kill()
    assert child.wait(10) == -signal.SIGKILL
    assert sibling.ended
    sibling.close()


def graph_without(node, limit):
    graph = LaunchedGraph(SIMULATED, GraphSettings(restart_limit=limit))
    graph._processes = [SimpleNamespace(nodes=(node,), pid=7, ended=True)]
    return graph


def test_the_end_of_a_process_is_told_by_the_supervisor_where_launch_starts_it_again():
    with pytest.raises(NodesLostError, match='mount_control has ended'):
        graph_without(CONTROL, limit=3).check_processes()


@pytest.mark.parametrize(('node', 'limit'), [(CONTROL, 0), (SIM, 3)])
def test_the_end_of_a_process_is_left_to_launch_where_that_ends_all_for_it(node, limit):
    graph_without(node, limit).check_processes()


def test_the_supervisor_of_a_launch_that_was_killed_ends(monkeypatch):
    class Ended:
        ended = True

    monkeypatch.setattr(launched, 'Starter', Ended)
    with pytest.raises(GraphError, match='launch has ended'):
        LaunchedGraph(VEHICLE, GraphSettings()).wait_until(lambda: False, 1.0, 'nothing')
