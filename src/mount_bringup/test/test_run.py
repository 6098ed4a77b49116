"""The executable `mount_supervisor`: its arguments, exit codes and sentences."""

import os

import pytest

from mount_bringup.graph import domain, run
from mount_bringup.graph.graph import Graph
from mount_bringup.graph.nodes import CONTROL, VEHICLE, GraphError, GraphSettings
from mount_bringup.graph.recovery import RecoveryAction, Restart
from mount_bringup.graph.shutdown import Interrupted
from mount_bringup.graph.supervisor import Supervisor

LOST = Restart(0, (CONTROL,), 'mount_control ended', RecoveryAction.DAMP_ON, 1.5)


class Supervised:
    """A graph whose start ends in `outcome`; it notes its stop."""

    notes = ('mount_init refused; it was activated again',)
    finished = True

    def __init__(self, outcome=None, complaints=(), restarts=()):
        self.outcome, self.complaints, self.stopped = outcome, list(complaints), 0
        self.recovery = self
        self.restarts = restarts

    def interrupt(self):
        pass

    def start(self, session, report):
        self.session = session({'mount_control': {'eigenfrequency': 9.0}})
        if self.outcome:
            raise self.outcome

    def wait_until(self, condition, limit, what):
        assert condition()

    def stop(self):
        self.stopped += 1
        return self.complaints


@pytest.fixture
def supervise(monkeypatch, capfd):
    """Return the function that runs a graph by the command, and its exit code and output."""
    monkeypatch.setenv('ROS_DOMAIN_ID', '5')
    monkeypatch.setattr(domain, '_PLACE', f'\0engine_mount_test_{os.getpid()}')

    def run_with(graph, *words):
        monkeypatch.setattr(run, 'Supervisor', lambda *arguments: graph)
        code = run.run(['vehicle', 'record:=false', *words])
        return code, ''.join(capfd.readouterr())

    return run_with


@pytest.mark.parametrize(
    ('graph', 'code', 'sentence'),
    [
        (Supervised(), 0, 'the end of the drive'),
        (Supervised(Interrupted()), 0, 'activated again'),
        (Supervised(GraphError('mount_init refused to activate: no ripple')), 1, 'activate: no ripple'),
        (Supervised(complaints=['mount_recorder ended with code 1']), 1, 'mount_recorder ended with code 1'),
        (Supervised(restarts=[LOST]), 1, 'mount_control ended; it is started again'),
    ],
)
def test_every_end_stops_the_graph_and_what_went_wrong_is_told_and_ends_with_code_1(
    supervise, graph, code, sentence
):
    found, output = supervise(graph)
    assert found == code
    assert graph.stopped == 1
    assert sentence in output
    assert 'eigenfrequency: 9.0' in graph.session
    assert 'versions:' in graph.session


def test_what_cannot_be_is_refused_before_anything_starts(supervise):
    graph = Supervised()
    code, output = supervise(graph, 'chanel:=can1')
    assert (code, graph.stopped) == (1, 0)
    assert "'chanel' is no parameter of vehicle.launch.py; did you mean channel" in output


def test_a_supervisor_ends_with_the_process_that_has_started_it(monkeypatch, tmp_path):
    graph = Supervisor(VEHICLE, GraphSettings(), tmp_path)
    monkeypatch.setattr(Graph, 'serve_once', lambda graph: None)
    graph._starter._had_ended = True
    with pytest.raises(GraphError, match=r'the process that started this one .* has ended'):
        graph.wait_until(lambda: False, 1.0, 'nothing')


def test_the_end_notes_each_node_that_was_activated_again(tmp_path):
    graph = Supervisor(VEHICLE, GraphSettings(), tmp_path)
    graph.repeats = {'mount_init': 'no ripple'}
    assert graph.stop() == []
    assert graph.notes == ['no ripple; it was activated again']
