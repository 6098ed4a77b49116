"""How often an activation is repeated after a refusal, and in which order nodes end."""

import pytest

from mount_bringup.graph import activation
from mount_bringup.graph.graph import ACTIVATE, DEACTIVATE, Graph
from mount_bringup.graph.nodes import (
    DRIVER,
    INIT,
    SIM,
    SIMULATED,
    VEHICLE,
    GraphError,
    GraphSettings,
    ending_order,
)


class Refused(Graph):
    """Its nodes refuse so many times; with every attempt pass `samples`, of which `overruns` are late."""

    def __init__(self, refusals, *, timeouts=0, samples=1000, overruns=0, sample_rate=None):
        super().__init__((INIT,), GraphSettings())
        self.refusals, self.attempts = refusals, 0
        self.rate = {} if sample_rate is None else {'sample_rate': str(sample_rate)}
        self.each = {
            DRIVER.name: {'late_setpoints': timeouts},
            SIM.name: {'samples': samples, 'overruns': overruns},
        }

    def change_states(self, nodes, transition):
        self.attempts += 1
        return dict.fromkeys(nodes, 'mount_init refused') if self.attempts <= self.refusals else {}

    def figures(self, node):
        counts = {name: str(count * self.attempts) for name, count in self.each[node.name].items()}
        return {**counts, **self.rate}

    def serve_for(self, duration):
        pass

    def activate_init(self):
        activation.Activation(self).activate([INIT])


def test_a_refusal_in_time_is_repeated_once():
    graph = Refused(1)
    graph.activate_init()
    assert graph.attempts == 2
    assert graph.notes == ['mount_init refused; it was activated again']


@pytest.mark.parametrize('pace', [{}, {'overruns': 50}])
def test_a_node_that_refuses_in_time_is_given_up(pace):
    graph = Refused(9, **pace)
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.attempts == 2


@pytest.mark.parametrize(
    ('pace', 'rate'),
    [({'overruns': 51}, '1 kHz'), ({'timeouts': 1, 'sample_rate': 2000.0}, '2 kHz')],
)
def test_refusals_of_a_machine_that_was_late_do_not_count(pace, rate):
    graph = Refused(9, **pace)
    graph.activate_init()
    assert graph.attempts == 10
    late = f'mount_init refused (this machine was too late for {rate})'
    assert graph.notes == [f'{late}; it was activated again, the last of 9 times']


def test_a_machine_that_stays_late_is_given_up(monkeypatch):
    monkeypatch.setattr(activation, '_LATE_PATIENCE', 0.0)
    graph = Refused(9, timeouts=1)
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.attempts == 1


class OffUntilInitialised(Refused):
    """Its mount_init refuses until the driver, which is off, was activated anew `resets` times."""

    def __init__(self, resets, **flags):
        super().__init__(0)
        self.done, self.resets, self.flags = [], resets, {'needs_initialisation': 'True', **flags}
        self.reports.forget = lambda node: self.done.append(f'forget {node.name}')

    def change_states(self, nodes, transition):
        [node] = nodes
        self.done.append(f'{ {ACTIVATE: "activate", DEACTIVATE: "deactivate"}[transition] } {node.name}')
        self.resets -= node == DRIVER and transition == ACTIVATE
        return {INIT: 'mount_init refused'} if node == INIT and self.resets > 0 else {}

    def figures(self, node):
        return {'sentence': 'the electronics were reset', **self.flags} if self.resets > 0 else {}


@pytest.mark.parametrize('resets', [1, 4])
def test_a_driver_that_is_off_until_initialised_is_activated_anew_before_the_initialisation(resets):
    graph = OffUntilInitialised(resets)
    graph.activate_init()
    anew = ['activate mount_init', 'deactivate mount_driver', 'forget mount_driver', 'activate mount_driver']
    assert graph.done == [*anew * resets, 'activate mount_init']
    assert [note.partition(';')[0] for note in graph.notes] == [
        'mount_init refused',
        'the electronics were reset',
    ]


def test_a_driver_that_is_off_for_good_is_not_activated_anew():
    graph = OffUntilInitialised(1, needs_initialisation='False')
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.done == ['activate mount_init'] * 2


def test_electronics_outlive_whoever_watches_them_and_the_recorder_outlives_all():
    ended = [node.name for node in ending_order(SIMULATED)]
    assert ended == ['mount_control', 'mount_init', 'mount_driver', 'mount_sim', 'mount_recorder']
    assert [node.name for node in ending_order(VEHICLE)] == [name for name in ended if name != 'mount_sim']
