"""What is done, in which order, after the loss of a node, on a graph that only notes it."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, SIMULATED
from mount_bringup.graph.recovery import Recovery
from mount_bringup.graph.restarts import Loss, NodesLostError, Remedy

LABELS = {Transition.TRANSITION_CONFIGURE: 'configure', Transition.TRANSITION_DEACTIVATE: 'deactivate'}
DRIVING = {'state': 'active', 'restarts': '0', 'gaps': '0', 'samples': '9000', 'lost': '0',
           'last_stamp': '9000000000', 'sample_rate': '1000'}  # fmt: skip
TABLE = {'state': 'active', 'last_stamp': '5000000000'}


class Answer:
    def __init__(self, result):
        self._result = result

    def done(self):
        return True

    def result(self):
        return self._result


class Graph:
    """A graph in which everything works; `loses` may name a node at whose configuration another is lost."""

    nodes = SIMULATED

    def __init__(self, folder):
        self.done = []
        self.parameters = {RECORDER.name: {'uri': str(folder / 'recording')}}
        self.said = {node.name: {'state': 'active'} for node in SIMULATED}
        self.said |= {DRIVER.name: dict(DRIVING), INIT.name: dict(TABLE)}
        self.next_words = dict(DRIVING)
        self.verdicts = SimpleNamespace(forget=lambda node: self.said[node.name].update(self.next_words))
        self.loses = {}
        self.told = []

    def tell_loss(self, reason):
        self.told.append(reason)

    def figures(self, node):
        return self.said.get(node.name, {})

    def start_again(self, nodes):
        self.done += [f'start {node.name}' for node in nodes]

    def client(self, kind, service):
        answer = GetState.Response(current_state=State(id=State.PRIMARY_STATE_UNCONFIGURED))
        return SimpleNamespace(service_is_ready=lambda: True, call_async=lambda _: Answer(answer))

    def call(self, kind, service, request):
        if kind is SetParameters:
            [parameter] = request.parameters
            value = parameter.value
            value = value.string_value or value.double_value or value.bool_value
            self.done.append(f'{service.removesuffix("/set_parameters")}.{parameter.name} = {value}')
            return SetParameters.Response(results=[SetParametersResult(successful=True)])
        return GetState.Response(current_state=State(id=State.PRIMARY_STATE_ACTIVE))

    def transition(self, node, transition):
        self.done.append(f'{LABELS[transition]} {node.name}')
        if transition == Transition.TRANSITION_CONFIGURE and node.name in self.loses:
            lost = self.loses.pop(node.name)
            raise NodesLostError(Loss((lost,), f'{lost.name} ended'))

    def activate(self, node, say):
        self.done.append(f'activate {node.name}')

    def wait_until(self, condition, limit, what):
        assert condition(), what

    def wait_for_matches(self):
        self.done.append('match')


@pytest.fixture
def graph(tmp_path):
    return Graph(tmp_path)


def made_good(graph, *nodes, limit=3):
    recovery = Recovery(graph, limit)
    recovery.make_good(Loss(nodes, 'lost'))
    [restart] = recovery.restarts
    return restart.remedy


def test_a_recorder_goes_on_in_another_folder_and_nothing_else_is_touched(graph, tmp_path):
    assert made_good(graph, RECORDER) is Remedy.RECORD_ANEW
    (tmp_path / 'recording').mkdir()
    assert graph.done == [
        'start mount_recorder',
        f'mount_recorder.uri = {tmp_path}/recording',
        'configure mount_recorder',
        'match',
        'activate mount_recorder',
    ]
    graph.done.clear()
    made_good(graph, RECORDER)
    assert graph.done[1] == f'mount_recorder.uri = {tmp_path}/recording_restarted_2'


def test_a_control_is_told_that_its_table_holds_and_damps_again(graph):
    assert made_good(graph, CONTROL) is Remedy.DAMP_ON
    assert graph.done == [
        'start mount_control',
        'mount_control.measured_before = True',
        'configure mount_control',
        'match',
        'activate mount_control',
    ]


INITIALISED = ['activate mount_driver', 'activate mount_init', 'activate mount_control']


def test_a_control_without_a_table_that_holds_waits_for_a_new_initialisation(graph):
    graph.said[DRIVER.name]['gaps'] = '1'
    assert made_good(graph, CONTROL) is Remedy.INITIALISE
    assert graph.done == [
        'start mount_control',
        'deactivate mount_init',
        'deactivate mount_driver',
        'mount_control.measured_before = False',
        'configure mount_control',
        'match',
        *INITIALISED,
    ]


def test_measurements_that_break_off_while_control_starts_end_in_a_new_initialisation(graph):
    graph.next_words['restarts'] = '1'
    assert made_good(graph, CONTROL) is Remedy.INITIALISE
    assert graph.done[-3:] == INITIALISED
    assert graph.done.index('mount_control.measured_before = False') > graph.done.index('match')


def test_a_driver_started_again_is_told_how_hot_its_coil_was_if_the_one_before_knew(graph):
    graph.said[DRIVER.name] |= {'coil_model_celsius': '131.5', 'coil_model_known': 'True'}
    made_good(graph, DRIVER)
    given = graph.done.index('mount_driver.coil_celsius_before = 131.5')
    assert given < graph.done.index('configure mount_driver')
    other = Graph(Path(graph.parameters[RECORDER.name]['uri']).parent)
    other.said[DRIVER.name] |= {'coil_model_celsius': '152.2', 'coil_model_known': 'False'}
    made_good(other, DRIVER)
    assert not any('coil_celsius_before' in each for each in other.done)


def test_a_lost_driver_is_started_before_anything_is_waited_for_and_comes_back_with_an_initialisation(graph):
    assert made_good(graph, DRIVER) is Remedy.INITIALISE
    assert graph.done == [
        'start mount_driver',
        'deactivate mount_control',
        'deactivate mount_init',
        'configure mount_driver',
        'match',
        *INITIALISED,
    ]


def test_electronics_that_were_reset_are_initialised_without_a_restart(graph):
    assert made_good(graph) is Remedy.INITIALISE
    assert graph.done == [
        'deactivate mount_control',
        'deactivate mount_init',
        'deactivate mount_driver',
        'match',
        *INITIALISED,
    ]


def test_an_initialisation_that_has_done_its_work_stands_by(graph):
    assert made_good(graph, INIT) is Remedy.STAND_BY
    assert graph.done == ['start mount_init', 'configure mount_init', 'match']


def test_a_control_that_somebody_deactivated_is_not_activated(graph):
    graph.said[CONTROL.name]['state'] = 'inactive'
    made_good(graph, DRIVER)
    assert graph.done[-2:] == INITIALISED[:2]


def test_a_node_lost_meanwhile_is_made_good_with_the_first(graph):
    graph.loses = {DRIVER.name: CONTROL}
    assert made_good(graph, DRIVER) is Remedy.INITIALISE
    assert graph.done.count('start mount_driver') == 2
    assert 'start mount_control' in graph.done
    assert graph.done[-3:] == INITIALISED
    assert graph.told == [
        f'{reason}; the mount is initialised anew' for reason in ('lost', 'mount_control ended')
    ]


def test_a_node_that_cannot_stay_alive_ends_the_graph_and_is_told_once_each_time(graph):
    graph.loses = {CONTROL.name: CONTROL}
    with pytest.raises(GraphError, match='mount_control ended; mount_control was lost 2 times'):
        made_good(graph, CONTROL, limit=1)
    assert graph.told == ['lost; it is started again and activated with the table that holds']


def test_without_restarts_a_loss_stands_in_the_error_alone(graph):
    with pytest.raises(GraphError, match=r'^lost$'):
        made_good(graph, CONTROL, limit=0)
    assert graph.told == graph.done == []
