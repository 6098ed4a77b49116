"""How often an activation is repeated after a refusal."""

import pytest

from mount_bringup.graph import graph as graph_module
from mount_bringup.graph.graph import Graph
from mount_bringup.graph.nodes import DRIVER, INIT, GraphError, GraphSettings


class Refused(Graph):
    """Its `mount_init` refuses `refusals` times; with each attempt `late` setpoints come too late.

    Or, with `resets`, until the driver, which is off, was activated anew so many times.
    """

    def __init__(self, refusals, late=0, resets=0, needs='True'):
        super().__init__((DRIVER, INIT), GraphSettings())
        self.refusals, self.late, self.resets, self.needs = refusals, late, resets, needs
        self.done = []

    def figures(self, node):
        attempts = self.done.count('activate mount_init')
        off = {'sentence': 'the electronics were reset', 'needs_initialisation': self.needs}
        return {'late_setpoints': str(self.late * attempts), **(off if self.resets > 0 else {})}

    def forget(self, node):
        self.done.append(f'forget {node.name}')

    def change_states(self, nodes, transition):
        [node] = nodes
        self.done.append(f'{transition} {node.name}')
        self.resets -= self.done[-1] == 'activate mount_driver'
        self.refusals -= node == INIT
        refuses = self.refusals >= 0 or self.resets > 0
        return {INIT: 'mount_init refused'} if node == INIT and refuses else {}

    def serve_for(self, duration):
        pass


def test_a_refusal_in_time_is_repeated_once():
    graph = Refused(1)
    graph.activate([INIT])
    assert graph.done == ['activate mount_init'] * 2
    assert graph.repeats == {INIT.name: 'mount_init refused'}
    graph = Refused(9)
    with pytest.raises(GraphError):
        graph.activate([INIT])
    assert graph.done == ['activate mount_init'] * 2


def test_refusals_of_a_machine_that_was_late_do_not_count_for_a_minute(monkeypatch):
    graph = Refused(9, late=1)
    graph.activate([INIT])
    assert len(graph.done) == 10
    assert graph.repeats == {INIT.name: 'mount_init refused (this machine was too late for setpoints)'}
    monkeypatch.setattr(graph_module, 'LATE_PATIENCE', 0.0)
    with pytest.raises(GraphError):
        Refused(9, late=1).activate([INIT])


@pytest.mark.parametrize('resets', [1, 4])
def test_a_driver_that_is_off_until_initialised_is_activated_anew_before_the_initialisation(resets):
    graph = Refused(0, resets=resets)
    graph.activate([INIT])
    anew = ['activate mount_init', 'deactivate mount_driver', 'forget mount_driver', 'activate mount_driver']
    assert graph.done == [*anew * resets, 'activate mount_init']
    assert graph.repeats == {INIT.name: 'mount_init refused', DRIVER.name: 'the electronics were reset'}


def test_a_driver_that_is_off_for_good_is_not_activated_anew():
    graph = Refused(0, resets=1, needs='False')
    with pytest.raises(GraphError):
        graph.activate([INIT])
    assert graph.done == ['activate mount_init'] * 2
