"""How often a node that refuses to be activated is asked again, and in which order nodes end."""

import pytest
from lifecycle_msgs.msg import Transition

from mount_bringup.graph import activation
from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import DRIVER, INIT, SIM, SIMULATED, VEHICLE, GraphSettings, ending_order
from mount_bringup.graph.supervisor import Supervisor


class Refused(Supervisor):
    """Its nodes refuse so many times; with every attempt pass `samples`, of which `overruns` are late."""

    def __init__(self, folder, refusals, *, timeouts=0, samples=1000, overruns=0, sample_rate=None):
        super().__init__((INIT,), GraphSettings(), folder)
        self.refusals, self.asked = refusals, 0
        self.rate = {} if sample_rate is None else {'sample_rate': str(sample_rate)}
        self.each = {
            DRIVER.name: {'late_setpoints': timeouts},
            SIM.name: {'samples': samples, 'overruns': overruns},
        }

    def transition(self, node, transition):
        self.asked += 1
        if self.asked <= self.refusals:
            raise GraphError('mount_init refused')

    def figures(self, node):
        counts = {name: str(count * self.asked) for name, count in self.each[node.name].items()}
        return {**counts, **self.rate}

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


@pytest.mark.parametrize(
    ('pace', 'rate'),
    [({'overruns': 51}, '1 kHz'), ({'timeouts': 1, 'sample_rate': 2000.0}, '2 kHz')],
)
def test_refusals_of_a_machine_that_was_late_do_not_count(tmp_path, pace, rate):
    graph = Refused(tmp_path, 9, **pace)
    graph.activate_init()
    assert graph.asked == 10
    late = f'mount_init refused (this machine was too late for {rate})'
    assert graph.notes == [f'{late}; it was activated again, the last of 9 times']


def test_a_machine_that_stays_late_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(activation, '_LATE_PATIENCE', 0.0)
    graph = Refused(tmp_path, 9, timeouts=1)
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.asked == 1


class OffUntilInitialised(Refused):
    """Its mount_init refuses until the driver, which is off, was activated anew `resets` times."""

    def __init__(self, folder, resets, **told):
        super().__init__(folder, 0)
        self.done, self.resets, self.told = [], resets, {'needs_initialisation': 'True', **told}
        self.verdicts.forget = lambda node: self.done.append(f'forget {node.name}')

    def transition(self, node, transition):
        labels = {Transition.TRANSITION_ACTIVATE: 'activate', Transition.TRANSITION_DEACTIVATE: 'deactivate'}
        self.done.append(f'{labels[transition]} {node.name}')
        if node == DRIVER and transition == Transition.TRANSITION_ACTIVATE:
            self.resets -= 1
        if node == INIT and self.resets > 0:
            raise GraphError('mount_init refused')

    def figures(self, node):
        return {'sentence': 'the electronics were reset', **self.told} if self.resets > 0 else {}


@pytest.mark.parametrize('resets', [1, 4])
def test_a_driver_that_is_off_until_initialised_is_activated_anew_before_the_initialisation(tmp_path, resets):
    graph = OffUntilInitialised(tmp_path, resets)
    graph.activate_init()
    anew = ['activate mount_init', 'deactivate mount_driver', 'forget mount_driver', 'activate mount_driver']
    assert graph.done == [*anew * resets, 'activate mount_init']
    assert [note.partition(';')[0] for note in graph.notes] == [
        'mount_init refused',
        'the electronics were reset',
    ]


def test_a_driver_that_is_off_for_good_is_not_activated_anew(tmp_path):
    graph = OffUntilInitialised(tmp_path, 1, needs_initialisation='False')
    with pytest.raises(GraphError):
        graph.activate_init()
    assert graph.done == ['activate mount_init'] * 2


def test_electronics_outlive_whoever_watches_them_and_the_recorder_outlives_all():
    ended = [node.name for node in ending_order(SIMULATED)]
    assert ended == ['mount_control', 'mount_init', 'mount_driver', 'mount_sim', 'mount_recorder']
    assert [node.name for node in ending_order(VEHICLE)] == [name for name in ended if name != 'mount_sim']
