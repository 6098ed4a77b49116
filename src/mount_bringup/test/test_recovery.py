"""What follows the failure of nodes: action, limit, the order of its steps; and a new initialisation."""

import re
import time
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from ros_testing import LIMIT
from std_srvs.srv import Trigger

from mount_bringup.graph.graph import CONFIGURE
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    SIMULATED,
    GraphError,
    GraphSettings,
)
from mount_bringup.graph.recovery import (
    ACTIONS,
    NodesFailedError,
    Recovery,
    RecoveryAction,
    recovery_action,
    table_holds,
)
from mount_bringup.graph.supervisor import Supervisor

MEASURING = {'state': 'active', 'restarts': '0', 'gaps': '0', 'samples': '9000', 'lost': '5',
             'last_stamp': '10000000000', 'sample_rate': '1000.0'}  # fmt: skip
LATCHED = {'state': 'active', 'last_stamp': '4000000000'}
INITIALISED = ['activate mount_driver', 'activate mount_init', 'activate mount_control']


@pytest.mark.parametrize(
    ('nodes', 'holds', 'expected'),
    [
        ((RECORDER,), False, RecoveryAction.RECORD_ANEW),
        ((CONTROL,), True, RecoveryAction.DAMP_ON),
        ((CONTROL,), False, RecoveryAction.INITIALISE),
        ((INIT,), True, RecoveryAction.STAND_BY),
        ((INIT, CONTROL), True, RecoveryAction.INITIALISE),  # the table was latched by the node that died
        ((DRIVER,), True, RecoveryAction.INITIALISE),
        ((RECORDER, CONTROL), True, RecoveryAction.DAMP_ON),
        ((), True, RecoveryAction.INITIALISE),  # the electronics were reset
        ((SIM, CONTROL), True, RecoveryAction.END),
    ],
)
def test_what_follows_the_failure_of_nodes(nodes, holds, expected):
    assert recovery_action(nodes, table_holds=holds) is expected
    assert {*ACTIONS} == {node.name for node in SIMULATED}


@pytest.mark.parametrize(
    ('driver', 'init', 'expected'),
    [
        ({}, {}, True),
        ({'gaps': '1'}, {}, False),
        ({'restarts': '1'}, {}, False),
        ({'samples': '5900'}, {}, False),  # activated since: electronics and driver may have been away
        ({'sample_rate': '2000.0'}, {}, False),  # 9000 samples are 4.5 s
        ({'state': 'inactive'}, {}, False),
        ({'needs_initialisation': 'True'}, {}, False),
        ({}, {'state': 'inactive'}, False),
        ({'samples': 'unknown'}, {}, False),
        ({}, {'last_stamp': ''}, False),
    ],
)
def test_a_table_holds_only_while_the_driver_has_measured_without_a_break_since_before_it(
    driver, init, expected
):
    assert table_holds({**MEASURING, **driver}, {**LATCHED, **init}) is expected
    assert not table_holds({}, {**LATCHED, **init})
    assert not table_holds({**MEASURING, **driver}, {})


class Answer:
    """The answer to a request, at once."""

    def __init__(self, result):
        self.done, self.result = lambda: True, lambda: result


class Graph:
    """A graph that notes what is done; while `during` is configured, `lost` fails."""

    def __init__(self, folder='', nodes=SIMULATED, resting=()):
        self.nodes, self.resting, self.done = nodes, resting, []
        self.settings = GraphSettings(parameters={RECORDER.name: {'uri': f'{folder}/recording'}})
        self.last = {node.full_name: {'state': 'active'} for node in nodes}
        self.last |= {DRIVER.name: dict(MEASURING), INIT.name: dict(LATCHED)}
        self.next, self.during, self.lost = {}, None, None

    def figures(self, node):
        return self.last.get(node.full_name, {})

    def fresh_figures(self, node):
        self.last[node.full_name].update(self.next)
        return {'sentence': f'gap of {node.full_name}'} if node.is_a(INIT) else self.figures(node)

    def forget(self, node):
        pass

    def process(self, node):
        start = partial(self.done.append, f'start {node.full_name}')
        return SimpleNamespace(nodes=(node,), start_again=start)

    def client(self, kind, service):
        answer = GetState.Response(current_state=State(id=State.PRIMARY_STATE_UNCONFIGURED))
        return SimpleNamespace(service_is_ready=lambda: True, call_async=lambda _: Answer(answer))

    def call(self, kind, service, parameters):
        assert kind is SetParameters
        [parameter] = parameters
        value = parameter.value
        value = value.string_value or value.double_value or value.bool_value
        self.done.append(f'{service.removesuffix("/set_parameters")}.{parameter.name} = {value}')
        return SetParameters.Response(results=[SetParametersResult(successful=True)])

    def deactivate(self, node):
        if node.full_name not in self.resting:
            self.done.append(f'deactivate {node.full_name}')

    def transition(self, nodes, transition):
        [node] = nodes
        assert transition == CONFIGURE
        self.done.append(f'configure {node.full_name}')
        if node == self.during:
            self.during = None
            raise NodesFailedError((self.lost,), f'{self.lost.name} ended')

    def activate(self, nodes):
        self.done += [f'activate {node.full_name}' for node in nodes]

    def wait_until(self, condition, limit, what):
        assert condition(), what

    def wait_for_matches(self):
        self.done.append('match')


@pytest.fixture
def graph(tmp_path):
    return Graph(tmp_path)


@pytest.fixture
def recovered(graph):
    """Return the function that recovers from failures of nodes: the last action, and what was reported."""

    def recover(*nodes, limit=3, times=1, reason='lost'):
        graph.settings = replace(graph.settings, restart_limit=limit)
        recovery, reports = Recovery(graph, [*map(graph.process, graph.nodes)]), []
        recovery.report = reports.append
        for _ in range(times):
            recovery.recover(NodesFailedError(nodes, reason))
        assert len(recovery.restarts) == times
        return recovery.restarts[-1].action, reports

    return recover


OFF = ['deactivate mount_control', 'deactivate mount_init', 'deactivate mount_driver']


@pytest.mark.parametrize(
    ('nodes', 'driver', 'steps'),
    [
        (
            [RECORDER],
            {},
            [
                'start mount_recorder',
                'mount_recorder.uri = FOLDER/recording',
                'configure mount_recorder',
                'match',
                'activate mount_recorder',
            ],
        ),
        (
            [CONTROL],
            {},
            [
                'start mount_control',
                'mount_control.measured_before = True',
                'configure mount_control',
                'match',
                'activate mount_control',
            ],
        ),
        (
            [CONTROL],
            {'gaps': '1'},
            [
                'start mount_control',
                *OFF[1:],
                'mount_control.measured_before = False',
                'configure mount_control',
                'match',
                *INITIALISED,
            ],
        ),
        ([DRIVER], {}, ['start mount_driver', *OFF[:2], 'configure mount_driver', 'match', *INITIALISED]),
        ([], {}, [*OFF, 'match', *INITIALISED]),
        ([INIT], {}, ['start mount_init', 'configure mount_init', 'match']),
    ],
    ids=lambda value: str(value)[:30],
)
def test_the_steps_of_a_recovery_in_their_order(graph, recovered, tmp_path, nodes, driver, steps):
    graph.last[DRIVER.name] |= driver
    recovered(*nodes)
    assert [step.replace(str(tmp_path), 'FOLDER') for step in graph.done] == steps


def test_a_recorder_goes_on_in_another_folder(graph, recovered, tmp_path):
    (tmp_path / 'recording').mkdir()
    recovered(RECORDER)
    assert graph.done[1] == f'mount_recorder.uri = {tmp_path}/recording_restarted_2'


def test_a_break_of_the_measurements_during_the_restart_of_a_control_leads_to_an_initialisation(
    graph, recovered
):
    graph.next = {'gaps': '1'}
    assert recovered(CONTROL)[0] is RecoveryAction.INITIALISE
    assert graph.done[-3:] == INITIALISED
    last = len(graph.done) - 1 - graph.done[::-1].index('mount_control.measured_before = False')
    assert last > graph.done.index('match')


@pytest.mark.parametrize('known', ['True', 'False'])
def test_a_driver_started_again_gets_the_temperature_of_its_coil_if_the_one_before_knew(
    graph, recovered, known
):
    graph.last[DRIVER.name] |= {'coil_model_celsius': '131.5', 'coil_model_known': known}
    recovered(DRIVER)
    before = graph.done[: graph.done.index('configure mount_driver')]
    assert ('mount_driver.coil_celsius_before = 131.5' in before) == (known == 'True')
    assert any('coil_celsius_before' in step for step in graph.done) == (known == 'True')


def test_a_control_that_somebody_deactivated_is_not_activated(graph, recovered):
    graph.last[CONTROL.name]['state'] = 'inactive'
    recovered(DRIVER)
    assert graph.done[-2:] == INITIALISED[:2]


def test_a_node_that_fails_during_the_recovery_is_recovered_with_the_first(graph, recovered):
    graph.during, graph.lost = DRIVER, CONTROL
    action, reports = recovered(DRIVER)
    assert action is RecoveryAction.INITIALISE
    assert graph.done.count('start mount_driver') == 2
    assert 'start mount_control' in graph.done
    assert graph.done[-3:] == INITIALISED
    assert reports == [
        f'{reason}; the mount is initialised anew' for reason in ('lost', 'mount_control ended')
    ]


@pytest.mark.parametrize(
    ('failure', 'sentence'),
    [
        (([CONTROL], 0), 'lost'),  # in the error alone
        (([SIM], 3), 'lost; without it there is no coil to drive: the graph ends'),
        (
            ([CONTROL], 2),
            'lost; mount_control was lost 3 times within 60 s (limit 2), so the graph is given up at 0 A: '
            'read the logs for the cause',
        ),
        (([], 1), 'electronics was lost 2 times'),
    ],
)
def test_a_failure_that_ends_the_graph_is_an_error_with_its_reason(recovered, failure, sentence):
    nodes, limit = failure
    with pytest.raises(GraphError, match=re.escape(sentence)):
        recovered(*nodes, limit=limit, times=limit + 1)


def test_failures_of_long_ago_do_not_count(graph, recovered, monkeypatch):
    now = iter(range(0, 10_000, 40))  # s: two readings of the clock for each recovery
    monkeypatch.setattr(time, 'monotonic', lambda: next(now))
    recovered(INIT, limit=1, times=4)
    assert graph.done.count('start mount_init') == 4


@pytest.mark.parametrize('resting', [(), (CONTROL.name,)])
def test_damping_ends_first_and_the_control_comes_back_last_even_if_it_was_refused_before(resting):
    graph = Graph(resting=resting)
    assert Recovery(graph, []).initialise_again() == 'mount_init: gap of mount_init'
    assert graph.done == [*OFF[len(resting) :], 'match', *INITIALISED]


def test_the_service_answers_with_the_gaps_or_the_reason_and_the_graph_is_served_meanwhile(domain, tmp_path):
    graph = Supervisor((DRIVER,), GraphSettings(domain=domain), tmp_path)
    graph.open()

    def initialise():
        served = []
        graph.node.create_timer(0.01, lambda: served.append(True))
        graph.wait_until(lambda: bool(served), LIMIT, 'a timer')
        return 'the gaps'

    def refuse():
        raise GraphError('no pads')

    answers = []
    for step in (None, initialise, refuse):
        graph._recovers, graph.recovery.initialise_again = step is not None, step
        answer = graph.call(Trigger, '/engine_mount_supervisor/reinitialize')
        answers.append((answer.success, answer.message.partition('; ')[0]))
    assert graph.stop() == []
    assert answers == [
        (False, 'not initialised: the graph starts, recovers or runs in lock-step'),
        (True, 'initialised anew'),
        (False, 'not initialised, the coil stays at 0 A: no pads'),
    ]
