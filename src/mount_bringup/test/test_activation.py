"""How often an activation is repeated after a refusal."""

import pytest

from mount_bringup.graph import activation
from mount_bringup.graph.graph import Graph
from mount_bringup.graph.nodes import DRIVER, INIT, SIM, GraphError, GraphSettings


class Refused(Graph):
    """Its nodes refuse so many times; with every attempt pass `samples`, of which `overruns` are late."""

    def __init__(self, refusals, *, timeouts=0, samples=1000, overruns=0, **rate):
        super().__init__((INIT,), GraphSettings())
        self.refusals, self.attempts = refusals, 0
        self.each = {
            DRIVER.name: {'late_setpoints': timeouts},
            SIM.name: {'samples': samples, 'overruns': overruns},
        }
        self.figures = lambda node: {
            **{name: str(count * self.attempts) for name, count in self.each[node.name].items()},
            **rate,
        }

    def change_states(self, nodes, transition):
        self.attempts += 1
        return dict.fromkeys(nodes, 'mount_init refused') if self.attempts <= self.refusals else {}

    def serve_for(self, duration):
        pass


def test_a_refusal_in_time_is_repeated_once():
    graph = Refused(1)
    activation.activate(graph, [INIT])
    assert graph.attempts == 2
    assert graph.repeats == {INIT.name: ['mount_init refused']}


@pytest.mark.parametrize('pace', [{}, {'overruns': 50}])
def test_a_node_that_refuses_in_time_is_given_up(pace):
    graph = Refused(9, **pace)
    with pytest.raises(GraphError):
        activation.activate(graph, [INIT])
    assert graph.attempts == 2


@pytest.mark.parametrize(
    ('pace', 'rate'),
    [({'overruns': 51}, '1 kHz'), ({'timeouts': 1, 'sample_rate': '2000.0'}, '2 kHz')],
)
def test_refusals_of_a_machine_that_was_late_do_not_count(pace, rate):
    graph = Refused(9, **pace)
    activation.activate(graph, [INIT])
    assert graph.attempts == 10
    late = f'mount_init refused (this machine was too late for {rate})'
    assert graph.repeats == {INIT.name: [late] * 9}


def test_a_machine_that_stays_late_is_given_up(monkeypatch):
    monkeypatch.setattr(activation, '_LATE_PATIENCE', 0.0)
    graph = Refused(9, timeouts=1)
    with pytest.raises(GraphError):
        activation.activate(graph, [INIT])
    assert graph.attempts == 1


class OffUntilInitialised(Refused):
    """Its mount_init refuses until the driver, which is off, was activated anew `resets` times."""

    def __init__(self, resets, needs='True'):
        super().__init__(0)
        self.done, self.resets = [], resets
        off = {'sentence': 'the electronics were reset', 'needs_initialisation': needs}
        self.figures = lambda node: off if self.resets > 0 else {}
        self.reports.forget = lambda node: self.done.append(f'forget {node.name}')

    def change_states(self, nodes, transition):
        [node] = nodes
        self.done.append(f'{transition} {node.name}')
        self.resets -= self.done[-1] == 'activate mount_driver'
        return {INIT: 'mount_init refused'} if node == INIT and self.resets > 0 else {}


@pytest.mark.parametrize('resets', [1, 4])
def test_a_driver_that_is_off_until_initialised_is_activated_anew_before_the_initialisation(resets):
    graph = OffUntilInitialised(resets)
    activation.activate(graph, [INIT])
    anew = ['activate mount_init', 'deactivate mount_driver', 'forget mount_driver', 'activate mount_driver']
    assert graph.done == [*anew * resets, 'activate mount_init']
    assert graph.repeats == {
        INIT.name: ['mount_init refused'] * resets,
        DRIVER.name: ['the electronics were reset'] * resets,
    }


def test_a_driver_that_is_off_for_good_is_not_activated_anew():
    graph = OffUntilInitialised(1, needs='False')
    with pytest.raises(GraphError):
        activation.activate(graph, [INIT])
    assert graph.done == ['activate mount_init'] * 2
