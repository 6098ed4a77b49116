"""A node that fails closed, seen from outside: by its services and its diagnostics."""

import threading

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_testing import LIMIT, wait_until

from mount_ros.nodes.diagnostics import Level, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.qos import publisher_qos
from mount_ros.topics import DIAGNOSTICS, DISPLACEMENT

CONFIGURE, ACTIVATE = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE
DEACTIVATE, CLEANUP = Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP
UNCONFIGURED, INACTIVE = State.PRIMARY_STATE_UNCONFIGURED, State.PRIMARY_STATE_INACTIVE
ACTIVE = State.PRIMARY_STATE_ACTIVE


class Probe(SafeLifecycleNode):
    """Notes its steps; a step listed in `faults` raises."""

    def __init__(self, **arguments):
        super().__init__('probe', **arguments)
        self.steps = []
        self.faults = {}
        self.verdict = Verdict(Level.OK, 'at work', {'turns': 3})
        self.judged = 0

    def configure(self):
        self.open_data_path().subscribe(DISPLACEMENT, lambda raw: None)
        self._step('configure')

    def activate(self):
        self._step('activate')

    def deactivate(self):
        self._step('deactivate')

    def cleanup(self):
        self._step('cleanup')

    def judge(self):
        self.judged += 1
        return self.verdict

    def _step(self, name):
        self.steps.append(name)
        if name in self.faults:
            raise self.faults[name]


class Operator:
    """Asks the node for transitions and listens to what it says."""

    def __init__(self, context):
        self.node = Node('operator', context=context)
        self.said = []
        self._change = self.node.create_client(ChangeState, '/mount_right/probe/change_state')
        self._state = self.node.create_client(GetState, '/mount_right/probe/get_state')
        self.node.create_subscription(
            DiagnosticArray,
            DIAGNOSTICS.name,
            lambda message: self.said.extend(message.status),
            publisher_qos(DIAGNOSTICS),
        )

    def change(self, transition):
        return self._ask(self._change, ChangeState.Request(transition=Transition(id=transition))).success

    @property
    def state(self):
        return self._ask(self._state, GetState.Request()).current_state.id

    def heard(self, level, sentence):
        return any((status.level[0], status.message) == (level, sentence) for status in self.said)

    def _ask(self, client, request):
        assert client.wait_for_service(LIMIT)
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        assert done.wait(LIMIT), 'the node does not answer'
        return future.result()


@pytest.fixture
def probe(context, serve):
    probe = Probe(context=context, namespace='mount_right')
    serve(probe)
    yield probe
    probe.faults.clear()
    probe.close()


@pytest.fixture
def operator(context, serve, probe):
    operator = Operator(context)
    serve(operator.node)
    wait_until(lambda: operator.heard(Level.OK, 'inactive'), 'first diagnostics')
    return operator


def test_a_node_goes_through_its_steps_and_says_so(probe, operator, capfd):
    assert [operator.change(transition) for transition in (CONFIGURE, ACTIVATE, DEACTIVATE, CLEANUP)] == [
        True
    ] * 4
    assert probe.steps == ['configure', 'activate', 'deactivate', 'cleanup']
    assert operator.state == UNCONFIGURED
    assert probe.data_path is None
    told = [line for line in capfd.readouterr().err.splitlines() if line.startswith('[INFO]')]
    assert told == [
        '[INFO] [mount_right.probe]: configured; its topics are those of the node /mount_right/probe_io',
        '[INFO] [mount_right.probe]: active',
        '[INFO] [mount_right.probe]: inactive',
        '[INFO] [mount_right.probe]: cleaned up',
    ]


@pytest.mark.parametrize('transition', [ACTIVATE, DEACTIVATE, CLEANUP])
def test_a_transition_that_is_not_valid_is_answered_with_no_and_the_node_lives(
    probe, operator, capfd, transition
):
    assert not operator.change(transition)
    assert f'transition {transition} refused' in capfd.readouterr().err
    assert probe.steps == []
    assert operator.change(CONFIGURE)
    assert operator.change(ACTIVATE)
    assert not operator.change(ACTIVATE)
    assert operator.state == ACTIVE
    assert probe.active
    assert probe.steps == ['configure', 'activate']


def test_a_misspelt_parameter_is_named_and_the_node_is_not_configured(context, capfd):
    node = SafeLifecycleNode('subject', context=context, parameter_overrides=[Parameter('levle', value=9.0)])
    node.declare_parameter('level', 8.0)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert "'levle' is no parameter of subject; did you mean level?" in capfd.readouterr().err
    node.destroy_node()


@pytest.mark.parametrize(
    ('error', 'sentence'),
    [
        (ValueError('gap (1 mm) is too wide; shim it'), 'gap (1 mm) is too wide; shim it'),
        (RuntimeError('nobody foresaw this'), 'RuntimeError: nobody foresaw this'),
    ],
)
@pytest.mark.parametrize('step', ['configure', 'activate'])
def test_a_refused_step_says_why_and_can_be_tried_again(probe, operator, capfd, step, error, sentence):
    steps = {
        'configure': (CONFIGURE, UNCONFIGURED, 'cleanup'),
        'activate': (ACTIVATE, INACTIVE, 'deactivate'),
    }
    transition, state_after, way_back = steps[step]
    if step == 'activate':
        assert operator.change(CONFIGURE)
    probe.faults[step] = error
    probe.steps.clear()
    assert not operator.change(transition)
    assert probe.steps == [step, way_back]
    assert operator.state == state_after
    assert not probe.active
    assert f'{step} failed: {sentence}' in capfd.readouterr().err
    wait_until(lambda: operator.heard(Level.ERROR, sentence), 'the sentence in the diagnostics')

    probe.faults.clear()
    operator.said.clear()
    assert operator.change(transition)
    if step == 'configure':
        assert operator.change(ACTIVATE)
    assert operator.state == ACTIVE
    wait_until(lambda: operator.heard(Level.OK, 'at work'), 'good diagnostics')


def test_diagnostics_tell_node_state_figures_and_topics_without_another_side(probe, operator):
    operator.change(CONFIGURE)
    operator.change(ACTIVATE)
    wait_until(lambda: operator.heard(Level.OK, 'at work'), 'diagnostics of the active node')
    status = next(status for status in operator.said if status.message == 'at work')
    assert (status.name, status.hardware_id) == ('mount_right/probe', 'mount_right')
    figures = {entry.key: entry.value for entry in status.values}
    assert figures == {
        'turns': '3',
        'state': 'active',
        'unmatched': '/mount_right/displacement',
        'other_writer': '',
        'data_node': '/mount_right/probe_io',
        'path_errors': '0',
        'real_time_priority': '0',
        'memory_locked': 'False',
    }


def test_a_change_of_the_verdict_is_told_at_once_and_no_change_once_a_second(probe, operator):
    operator.change(CONFIGURE)
    operator.change(ACTIVATE)
    before = probe.judged  # ten in a second
    for turn in range(10):
        probe.verdict = Verdict(Level.WARN, f'turn {turn}')
        wait_until(lambda turn=turn: operator.heard(Level.WARN, f'turn {turn}'), 'the new sentence')
    assert probe.judged - before < 50

    def told():
        return sum(status.message == 'turn 9' for status in operator.said)

    once, before = told(), probe.judged
    wait_until(lambda: told() >= once + 2, 'the same sentence again')
    assert probe.judged - before >= 10


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_a_data_thread_that_has_ended_is_an_error_whatever_the_node_thinks_of_itself(probe, operator, capfd):
    told = threading.Event()
    probe.after_failure = told.set

    def collapse():
        raise SystemExit('out of order')

    operator.change(CONFIGURE)
    operator.change(ACTIVATE)
    probe.data_path.add_poll(collapse)
    assert told.wait(LIMIT)
    sentence = 'the data thread has ended: SystemExit: out of order'
    wait_until(lambda: operator.heard(Level.ERROR, sentence), 'the sentence in the diagnostics')
    assert sentence in capfd.readouterr().err
    assert any(value.key == 'fatal' and value.value == 'True' for value in operator.said[-1].values)
    assert operator.change(DEACTIVATE)
    assert operator.change(CLEANUP)
