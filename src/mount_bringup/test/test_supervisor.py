"""How often a node that refuses to be activated is asked again, and in which order nodes end."""

import pytest

from mount_bringup.graph import activation
from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import DRIVER, INIT, SIM, SIMULATED, VEHICLE, GraphSettings, ending_order
from mount_bringup.graph.supervisor import Supervisor


class Refused(Supervisor):
    """Its nodes refuse so many times; with every attempt pass `samples`, of which `overruns` are late."""

    def __init__(self, folder, refusals, *, timeouts=0, samples=1000, overruns=0):
        super().__init__((INIT,), GraphSettings(), folder)
        self.refusals, self.asked = refusals, 0
        self.each = {
            DRIVER.name: {'setpoint_timeouts': timeouts},
            SIM.name: {'samples': samples, 'overruns': overruns},
        }

    def transition(self, node, transition):
        self.asked += 1
        if self.asked <= self.refusals:
            raise GraphError('mount_init refused')

    def figures(self, node):
        return {name: str(count * self.asked) for name, count in self.each[node.name].items()}

    def serve_for(self, duration):
        pass

    def activate_init(self):
        Supervisor.activate(self, INIT, lambda text: None)


def test_a_refusal_in_time_is_asked_for_once_more(tmp_path):
    graph = Refused(tmp_path, 1)
    graph.activate_init()
    assert graph.asked == 2
    assert graph.notes == ['mount_init refused; it was activated again']


@pytest.mark.parametrize('pace', [{}, {'overruns': 50}])
def test_a_node_that_refuses_in_time_is_given_up(tmp_path, pace):
    graph = Refused(tmp_path, 9, **pace)
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.asked == 2


@pytest.mark.parametrize('pace', [{'overruns': 51}, {'timeouts': 1}])
def test_refusals_of_a_machine_that_was_late_do_not_count(tmp_path, pace):
    graph = Refused(tmp_path, 9, **pace)
    graph.activate_init()
    assert graph.asked == 10
    assert 'this machine was too late for 1 kHz' in graph.notes[0]


def test_a_machine_that_stays_late_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(activation, '_LATE_PATIENCE', 0.0)
    graph = Refused(tmp_path, 9, timeouts=1)
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.asked == 1


def test_electronics_outlive_whoever_watches_them_and_the_recorder_outlives_all():
    ended = [node.name for node in ending_order(SIMULATED)]
    assert ended == ['mount_control', 'mount_init', 'mount_driver', 'mount_sim', 'mount_recorder']
    assert [node.name for node in ending_order(VEHICLE)] == [name for name in ended if name != 'mount_sim']
