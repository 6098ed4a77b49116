"""The service that begins a mount anew: what is done in which order, and what is answered."""

import threading
from dataclasses import replace
from types import SimpleNamespace

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, INIT, SIMULATED, of_mounts
from mount_bringup.graph.reinitialisation import initialise_anew, offer
from mount_ros.testing import LIMIT


class Graph:
    """A graph that only notes what is done; `resting` names nodes that are not active."""

    def __init__(self, nodes=SIMULATED, resting=()):
        self.nodes = nodes
        self.done = []
        self.verdicts = SimpleNamespace(forget=lambda node: self.done.append(f'ask {node.full_name}'))
        self._resting = resting

    def figures(self, node):
        return {'sentence': f'gap of {node.full_name}'}

    def call(self, kind, service, request):
        assert kind is GetState
        resting = service.removesuffix('/get_state') in self._resting
        state = State.PRIMARY_STATE_INACTIVE if resting else State.PRIMARY_STATE_ACTIVE
        return GetState.Response(current_state=State(id=state))

    def transition(self, node, transition):
        assert transition == Transition.TRANSITION_DEACTIVATE
        self.done.append(f'rest {node.full_name}')

    def activate(self, node, say):
        self.done.append(f'activate {node.full_name}')

    def wait_for_matches(self):
        self.done.append('match')

    def wait_until(self, condition, limit, what):
        assert condition(), what


def test_damping_ends_first_and_the_control_comes_back_last():
    graph = Graph()
    assert initialise_anew(graph, '') == 'mount_init: gap of mount_init'
    assert graph.done == [
        'rest mount_control', 'rest mount_init', 'rest mount_driver', 'match',
        'activate mount_driver', 'activate mount_init', 'activate mount_control', 'ask mount_init',
    ]  # fmt: skip


def test_a_control_that_was_refused_is_activated_too():
    graph = Graph(resting=('mount_control',))
    initialise_anew(graph, '')
    assert 'rest mount_control' not in graph.done
    assert 'activate mount_control' in graph.done


def test_of_several_mounts_one_is_initialised_or_all():
    graph = Graph(of_mounts(SIMULATED, ['left', 'right']))
    assert initialise_anew(graph, 'right') == 'right/mount_init: gap of right/mount_init'
    assert not any('left' in step for step in graph.done)
    both = Graph(of_mounts(SIMULATED, ['left', 'right']))
    told = initialise_anew(both, '')
    assert told == '; '.join(f'{mount}/mount_init: gap of {mount}/mount_init' for mount in ('left', 'right'))
    last_rest = both.done.index('match')
    controls = [both.done.index(f'rest {replace(CONTROL, mount=m).full_name}') for m in ('left', 'right')]
    others = [both.done.index(f'rest {replace(INIT, mount=m).full_name}') for m in ('left', 'right')]
    assert max(controls) < min(others) < last_rest


@pytest.fixture
def service(context):
    """Return a function that offers the service and returns its answer for a mount."""
    node, client_node = Node('keeper', context=context), Node('asker', context=context)
    executor = SingleThreadedExecutor(context=context)
    for each in (node, client_node):
        executor.add_node(each)

    def ask(begin, mount=''):
        offer(node, ['left', 'right'] if mount else [''], begin)
        name = f'/keeper/{mount}/reinitialize' if mount else '/keeper/reinitialize'
        client = client_node.create_client(Trigger, name)
        assert client.wait_for_service(LIMIT)
        answer = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(answer, LIMIT)
        return answer.result()

    yield ask, executor, node
    for each in (node, client_node):
        executor.remove_node(each)
        each.destroy_node()
    executor.shutdown()


def test_the_answer_tells_what_came_of_it(service):
    ask, _, _ = service
    answer = ask(lambda mount: f'mount_init of {mount!r}', 'right')
    assert (answer.success, answer.message) == (True, "initialised anew; mount_init of 'right'")


def test_a_refusal_is_answered_with_its_reason(service):
    ask, _, _ = service

    def begin(mount):
        raise GraphError('mount_init refused to activate: no pads')

    answer = ask(begin)
    assert not answer.success
    assert answer.message == 'not initialised, the coil stays at 0 A: mount_init refused to activate: no pads'


def test_the_graph_is_served_while_the_mount_is_initialised(service):
    ask, executor, node = service
    heard = threading.Event()

    def begin(mount):
        node.create_timer(0.01, heard.set)
        while not heard.is_set():
            executor.spin_once(LIMIT)
        return 'heard'

    assert ask(begin).message == 'initialised anew; heard'
