"""The supervisor's reading of `/diagnostics`."""

import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from mount_bringup.graph.graph import SILENCE_LIMIT
from mount_bringup.graph.nodes import DRIVER, SIMULATED, GraphError, GraphSettings
from mount_bringup.graph.recovery import NodesFailedError
from mount_bringup.graph.supervisor import Supervisor


@pytest.fixture
def graph(tmp_path):
    """A graph in the namespace `car`, whose nodes are all active."""
    made = Supervisor(SIMULATED, GraphSettings(namespace='/car'), tmp_path)
    made._recovers = True
    return made


def report(graph, name, sentence='', **figures):
    values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.ERROR, message=sentence, values=values)
    graph._take_report(DiagnosticArray(status=[status]))


def test_what_a_node_calls_fatal_ends_the_graph_with_its_sentence(graph):
    report(graph, 'car/mount_driver', 'coil switched off', fatal=False)
    graph._check_nodes()
    report(graph, 'car/mount_driver', 'coil switched off: over_current', fatal=True)
    with pytest.raises(GraphError, match=r'^mount_driver: coil switched off: over_current$'):
        graph._check_nodes()


@pytest.mark.parametrize(
    'name', ['mount_driver', 'bus/mount_driver', 'car/left/mount_driver', 'car/gearbox_driver']
)
def test_foreign_nodes_end_no_graph(graph, name):
    report(graph, name, 'broken', fatal=True, needs_initialisation=True)
    graph._check_nodes()


def test_a_request_for_an_initialisation_names_its_node_until_it_is_forgotten(graph):
    report(graph, 'car/mount_driver', 'counters jumped', needs_initialisation=True)
    with pytest.raises(NodesFailedError, match=r'^mount_driver: counters jumped$'):
        graph._check_nodes()
    graph.forget(DRIVER)
    graph._check_nodes()


@pytest.fixture
def clock(monkeypatch):
    """The steady clock, which goes on by `wait` as the supervisor checks; it returns the silent nodes."""
    now = [100.0]
    monkeypatch.setattr(time, 'monotonic', lambda: now[0])

    def wait(graph, duration):
        for _ in range(round(duration / 0.05)):
            now[0] += 0.05
            silent = graph.silent()
        return silent

    wait.stop = lambda duration: now.append(now.pop() + duration)
    return wait


def test_a_node_without_reports_is_silent_after_the_limit_and_not_before(graph, clock):
    report(graph, 'car/mount_control')
    assert clock(graph, SILENCE_LIMIT - 0.1) == []
    report(graph, 'car/mount_driver')
    assert clock(graph, 0.2) == ['mount_control']


@pytest.mark.parametrize('paused', [False, True])
def test_no_node_is_silent_in_a_pause_after_a_restart_or_while_the_supervisor_stood_still(
    graph, clock, paused
):
    report(graph, 'car/mount_control')
    report(graph, 'car/mount_driver')
    graph.forget(DRIVER)
    clock(graph, 1.0)
    if paused:
        graph.pause_silence()
    clock.stop(100.0)
    assert clock(graph, 2.0) == []
    assert clock(graph, 2.5) == ['mount_control']
