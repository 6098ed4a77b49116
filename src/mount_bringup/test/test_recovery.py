"""The order of the steps of a recovery, and of a new initialisation, on a graph that only notes them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from ros_testing import LIMIT
from std_srvs.srv import Trigger

from mount_bringup.graph import supervisor
from mount_bringup.graph.failures import NodeFailure, NodesFailedError, RecoveryAction
from mount_bringup.graph.graph import CONFIGURE, DEACTIVATE
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIMULATED,
    GraphError,
    GraphSettings,
    of_mounts,
)
from mount_bringup.graph.recovery import Recovery, initialise_again
from mount_bringup.graph.supervisor import Supervisor

LABELS = {CONFIGURE: 'configure', DEACTIVATE: 'deactivate'}
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
    """A graph in which everything works; `loses` may name a node at whose configuration another fails."""

    def __init__(self, folder='', nodes=SIMULATED, resting=()):
        self.nodes = nodes
        self.done = []
        self.parameters = {RECORDER.name: {'uri': f'{folder}/recording'}}
        self.reports = SimpleNamespace(forget=lambda node: None)
        self.last = {node.full_name: {'state': 'active'} for node in nodes}
        self.last |= {DRIVER.name: dict(DRIVING), INIT.name: dict(TABLE)}
        self.next = dict(DRIVING)
        self.loses = {}
        self.resting = resting

    def figures(self, node):
        return self.last.get(node.full_name, {})

    def fresh_figures(self, node):
        if node.is_a(INIT):
            return {'sentence': f'gap of {node.full_name}'}
        self.last[node.full_name].update(self.next)
        return self.figures(node)

    def start_again(self, nodes):
        self.done += [f'start {node.full_name}' for node in nodes]

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
        resting = service.removesuffix('/get_state') in self.resting
        state = State.PRIMARY_STATE_INACTIVE if resting else State.PRIMARY_STATE_ACTIVE
        return GetState.Response(current_state=State(id=state))

    def transition(self, nodes, transition):
        [node] = nodes
        self.done.append(f'{LABELS[transition]} {node.full_name}')
        if transition == CONFIGURE and node.name in self.loses:
            lost = self.loses.pop(node.name)
            raise NodesFailedError(NodeFailure((lost,), f'{lost.name} ended'))

    def activate(self, nodes):
        self.done += [f'activate {node.full_name}' for node in nodes]

    def wait_until(self, condition, limit, what):
        assert condition(), what

    def wait_for_matches(self):
        self.done.append('match')


@pytest.fixture
def graph(tmp_path):
    return Graph(tmp_path)


def recovered(graph, *nodes, limit=3, reports=None):
    recovery = Recovery(graph, graph, graph, limit)
    recovery.report = [].append if reports is None else reports.append
    recovery.recover(NodeFailure(nodes, 'lost'))
    [restart] = recovery.restarts
    return restart.action


def test_a_recorder_goes_on_in_another_folder_and_nothing_else_is_touched(graph, tmp_path):
    assert recovered(graph, RECORDER) is RecoveryAction.RECORD_ANEW
    (tmp_path / 'recording').mkdir()
    assert graph.done == [
        'start mount_recorder',
        f'mount_recorder.uri = {tmp_path}/recording',
        'configure mount_recorder',
        'match',
        'activate mount_recorder',
    ]
    graph.done.clear()
    recovered(graph, RECORDER)
    assert graph.done[1] == f'mount_recorder.uri = {tmp_path}/recording_restarted_2'


def test_a_control_is_told_that_its_table_holds_and_damps_again(graph):
    assert recovered(graph, CONTROL) is RecoveryAction.DAMP_ON
    assert graph.done == [
        'start mount_control',
        'mount_control.measured_before = True',
        'configure mount_control',
        'match',
        'activate mount_control',
    ]


INITIALISED = ['activate mount_driver', 'activate mount_init', 'activate mount_control']


def test_a_control_without_a_table_that_holds_waits_for_a_new_initialisation(graph):
    graph.last[DRIVER.name]['gaps'] = '1'
    assert recovered(graph, CONTROL) is RecoveryAction.INITIALISE
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
    graph.next['restarts'] = '1'
    assert recovered(graph, CONTROL) is RecoveryAction.INITIALISE
    assert graph.done[-3:] == INITIALISED
    assert graph.done.index('mount_control.measured_before = False') > graph.done.index('match')


def test_a_driver_started_again_is_told_how_hot_its_coil_was_if_the_one_before_knew(graph):
    graph.last[DRIVER.name] |= {'coil_model_celsius': '131.5', 'coil_model_known': 'True'}
    recovered(graph, DRIVER)
    given = graph.done.index('mount_driver.coil_celsius_before = 131.5')
    assert given < graph.done.index('configure mount_driver')
    other = Graph(Path(graph.parameters[RECORDER.name]['uri']).parent)
    other.last[DRIVER.name] |= {'coil_model_celsius': '152.2', 'coil_model_known': 'False'}
    recovered(other, DRIVER)
    assert not any('coil_celsius_before' in each for each in other.done)


def test_a_lost_driver_is_started_before_anything_is_waited_for_and_comes_back_with_an_initialisation(graph):
    assert recovered(graph, DRIVER) is RecoveryAction.INITIALISE
    assert graph.done == [
        'start mount_driver',
        'deactivate mount_control',
        'deactivate mount_init',
        'configure mount_driver',
        'match',
        *INITIALISED,
    ]


def test_electronics_that_were_reset_are_initialised_without_a_restart(graph):
    assert recovered(graph) is RecoveryAction.INITIALISE
    assert graph.done == [
        'deactivate mount_control',
        'deactivate mount_init',
        'deactivate mount_driver',
        'match',
        *INITIALISED,
    ]


def test_an_initialisation_that_has_done_its_work_stands_by(graph):
    assert recovered(graph, INIT) is RecoveryAction.STAND_BY
    assert graph.done == ['start mount_init', 'configure mount_init', 'match']


def test_a_control_that_somebody_deactivated_is_not_activated(graph):
    graph.last[CONTROL.name]['state'] = 'inactive'
    recovered(graph, DRIVER)
    assert graph.done[-2:] == INITIALISED[:2]


def test_a_node_that_fails_during_the_recovery_is_recovered_with_the_first(graph):
    graph.loses, reports = {DRIVER.name: CONTROL}, []
    assert recovered(graph, DRIVER, reports=reports) is RecoveryAction.INITIALISE
    assert graph.done.count('start mount_driver') == 2
    assert 'start mount_control' in graph.done
    assert graph.done[-3:] == INITIALISED
    assert reports == [
        f'{reason}; the mount is initialised anew' for reason in ('lost', 'mount_control ended')
    ]


def test_a_node_that_fails_again_and_again_ends_the_graph_and_is_reported_once_each_time(graph):
    graph.loses, reports = {CONTROL.name: CONTROL}, []
    with pytest.raises(GraphError, match='mount_control ended; mount_control was lost 2 times'):
        recovered(graph, CONTROL, limit=1, reports=reports)
    assert reports == ['lost; it is started again and activated with the table that holds']


def test_without_restarts_a_failure_stands_in_the_error_alone(graph):
    reports = []
    with pytest.raises(GraphError, match=r'^lost$'):
        recovered(graph, CONTROL, limit=0, reports=reports)
    assert reports == graph.done == []


def test_damping_ends_first_and_the_control_comes_back_last(graph):
    assert initialise_again(graph, graph, '') == 'mount_init: gap of mount_init'
    assert graph.done == [
        'deactivate mount_control',
        'deactivate mount_init',
        'deactivate mount_driver',
        'match',
        *INITIALISED,
    ]


def test_a_control_that_was_refused_is_activated_too():
    graph = Graph(resting=('mount_control',))
    initialise_again(graph, graph, '')
    assert 'deactivate mount_control' not in graph.done
    assert 'activate mount_control' in graph.done


def test_of_several_mounts_one_is_initialised_or_all():
    graph = Graph(nodes=of_mounts(SIMULATED, ['left', 'right']))
    assert initialise_again(graph, graph, 'right') == 'right/mount_init: gap of right/mount_init'
    assert not any('left' in step for step in graph.done)
    both = Graph(nodes=graph.nodes)
    gaps = initialise_again(both, both, '')
    assert gaps == '; '.join(f'{mount}/mount_init: gap of {mount}/mount_init' for mount in ('left', 'right'))
    controls, inits = (
        [both.done.index(f'deactivate {replace(kind, mount=mount).full_name}') for mount in ('left', 'right')]
        for kind in (CONTROL, INIT)
    )
    assert max(controls) < min(inits) < both.done.index('match')


@pytest.fixture
def service(domain, tmp_path, monkeypatch):
    """Return the function that calls the service of a supervisor, and its answer."""
    graph = Supervisor(of_mounts((DRIVER,), ['left', 'right']), GraphSettings(domain=domain), tmp_path)
    graph.open()

    def answer_of(initialise=None, mount=''):
        graph._recovers = initialise is not None
        monkeypatch.setattr(supervisor, 'initialise_again', initialise)
        answer = graph.call(Trigger, f'/engine_mount_supervisor/{mount}reinitialize', Trigger.Request())
        return answer.success, answer.message

    yield answer_of
    assert graph.stop() == []


def test_the_answer_holds_the_gaps(service):
    answer = service(lambda graph, activation, mount: f'mount_init of {mount!r}', 'right/')
    assert answer == (True, "initialised anew; mount_init of 'right'")


def test_a_refusal_is_answered_with_its_reason(service):
    def refuse(graph, activation, mount):
        raise GraphError('mount_init refused to activate: no pads')

    reason = 'not initialised, the coil stays at 0 A: mount_init refused to activate: no pads'
    assert service(refuse) == (False, reason)
    success, message = service()
    assert not success
    assert message.startswith('not initialised: the graph starts, recovers or runs in lock-step')


def test_the_graph_is_served_during_an_initialisation(service):
    def initialise(graph, activation, mount):
        served = []
        graph.node.create_timer(0.01, lambda: served.append(True))
        graph.wait_until(lambda: bool(served), LIMIT, 'a timer')
        return 'served'

    assert service(initialise) == (True, 'initialised anew; served')
