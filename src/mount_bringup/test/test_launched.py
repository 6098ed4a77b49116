"""When the end of a process ends a launched graph as a fault, and what its supervisor says."""

import signal

import pytest

from mount_bringup.graph import launched
from mount_bringup.graph.errors import GraphError, Interrupted
from mount_bringup.graph.launched import SUPERVISOR, LaunchedGraph, exit_error
from mount_bringup.graph.nodes import VEHICLE, GraphSettings


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
    ],
)
def test_a_process_that_ends_unasked_or_badly_is_a_fault_with_its_name(name, code, asked, error):
    assert exit_error(name, code, asked) == error


class Graph:
    """A graph whose bring-up ends in `outcome`; notes what it is told."""

    notes = ('mount_init refused; it was activated again',)

    def __init__(self, outcome=None):
        self.outcome, self.told = outcome, []

    def interrupt(self):
        pass

    def start(self, session, say):
        self.session = session({'mount_control': {'eigenfrequency': 9.0}})
        if self.outcome:
            raise self.outcome

    def figures(self, node):
        return {'sentence': 'finished'}

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


def test_the_supervisor_of_a_launch_that_was_killed_ends(monkeypatch):
    class Ended:
        ended = True

    monkeypatch.setattr(launched, 'Starter', Ended)
    with pytest.raises(GraphError, match='launch has ended'):
        LaunchedGraph(VEHICLE, GraphSettings()).wait_until(lambda: False, 1.0, 'nothing')
