"""Each node is taken down to unconfigured and up again while the rest of the graph runs."""

import time

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros_testing import wait_until
from std_srvs.srv import Trigger

from mount_ros.nodes.process import ros_context

LIMIT = 180.0  # s: other tests run at the same time, only a failure takes so long
STEP = 0.5  # s: how often the process is looked at while a service is awaited
POLL = 0.2  # s: the graph needs the machine more than who waits for it
DOWN = Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP
UP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE
NODES = 'mount_driver', 'mount_sim', 'mount_init', 'mount_control'


class Operator:
    """Asks services, as `ros2 lifecycle` and `ros2 service` do, of the graph of a `process`."""

    def __init__(self, context):
        self.process = None
        self._node = Node('operator', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)

    def ask(self, kind, service, **request):
        client = self._node.create_client(kind, service)
        try:
            self._wait(lambda: client.wait_for_service(STEP), service)
            answer = client.call_async(kind.Request(**request))
            self._wait(lambda: self._served(answer), service)
            return answer.result()
        finally:
            self._node.destroy_client(client)

    def _wait(self, step, service):
        """Take steps until one has succeeded: a service says nothing of a process that has ended."""
        end = time.monotonic() + LIMIT
        while not step():
            self.look()
            assert time.monotonic() < end, service

    def _served(self, answer):
        self._executor.spin_until_future_complete(answer, STEP)
        return answer.done()

    def look(self):
        assert self.process.poll() is None, self.process.communicate()[0]

    def change(self, node, transition):
        return self.ask(ChangeState, f'/{node}/change_state', transition=Transition(id=transition)).success

    def active(self, node):
        state = self.ask(GetState, f'/{node}/get_state').current_state.id
        return state == State.PRIMARY_STATE_ACTIVE

    def reinitialize(self):
        return self.ask(Trigger, '/engine_mount_supervisor/reinitialize').success

    def close(self):
        self._executor.remove_node(self._node)
        self._executor.shutdown()
        self._node.destroy_node()


@pytest.fixture
def operator(domain):
    with ros_context(domain) as context:
        made = Operator(context)
        yield made
        made.close()


@pytest.mark.slow
@pytest.mark.real_time
def test_every_node_can_be_taken_down_and_up_and_the_mount_initialised_anew(command, operator, bus_listener):
    process, out = command.start_drive(
        '--scenario', 'bench', '--duration', '600', '--set', 'mount_sim.timeline.start=0', '--no-report',
        '--priority', '0',
    )  # fmt: skip

    operator.process = process

    def damps():
        operator.look()
        time.sleep(POLL)
        driven = any(setpoint.current > 0.5 for setpoint in bus_listener[-200:])  # in a ramp as well
        return driven and all(operator.active(node) for node in NODES)

    wait_until(damps, 'damping', LIMIT)
    for walker in ('mount_control', 'mount_init', 'mount_driver', 'mount_sim'):
        for transition in DOWN:
            assert operator.change(walker, transition), (walker, transition)
        if walker == 'mount_control':
            wait_until(lambda: bus_listener[-1].current == 0.0, '0 A', LIMIT)
        assert operator.change(walker, UP[0]), walker
        operator.change(walker, UP[1])  # init and control refuse it: the mount must be initialised first
        wait_until(operator.reinitialize, f'initialisation after the walk of {walker}', LIMIT)
        wait_until(damps, f'damping after the walk of {walker}', LIMIT)
    said = (out / 'log' / 'mount_control.log').read_text()
    assert 'but mount_control has received the measurements without a break within' in said
    assert 'another node sent a current_setpoint' in (out / 'log' / 'mount_init.log').read_text()
