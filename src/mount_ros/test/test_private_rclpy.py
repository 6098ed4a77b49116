"""The names of rclpy that are not public are still there, and mean what they meant."""

import gc
import inspect

import pytest
from lifecycle_msgs.msg import Transition
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleNodeMixin
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from ros_testing import wait_until

from mount_ros.messages.cdr import message_class
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.private_rclpy import OpenLifecycleNode, given_at_start, raw_taker
from mount_ros.qos import publisher_qos
from mount_ros.topics import DISPLACEMENT

CHANGED = 'this rclpy has no {}: mount_ros.private_rclpy, the only file that uses it, must be changed'


@pytest.fixture
def subscription(source):
    kind, qos = message_class(DISPLACEMENT.type), publisher_qos(DISPLACEMENT)
    return source.node.create_subscription(kind, DISPLACEMENT.name, print, qos, raw=True)


def test_the_names_are_there(source, subscription):
    assert isinstance(getattr(Subscription, 'handle', None), property), CHANGED.format('Subscription.handle')
    assert hasattr(subscription, 'msg_type'), CHANGED.format('Subscription.msg_type')
    assert callable(getattr(subscription.handle, 'take_message', None)), CHANGED.format('take_message')
    publisher = source.node.create_publisher(message_class(DISPLACEMENT.type), DISPLACEMENT.name, 1)
    assert callable(getattr(publisher.handle, 'publish_raw', None)), CHANGED.format('publish_raw')
    assert hasattr(LifecycleNodeMixin, '_LifecycleNodeMixin__change_state'), CHANGED.format('__change_state')


def test_every_transition_passes_change_state():
    assert list(inspect.signature(OpenLifecycleNode._LifecycleNodeMixin__change_state).parameters) == [
        'self',
        'transition_id',
    ]
    for name in ('trigger_configure', 'trigger_shutdown', '_LifecycleNodeMixin__on_change_state'):
        method = getattr(LifecycleNodeMixin, name, None)
        assert method is not None, CHANGED.format(name)
        names = {*method.__code__.co_names, *method.__code__.co_consts}
        assert '_LifecycleNodeMixin__change_state' in names, f'{name} changes the state by other means'


def test_a_message_is_taken_with_the_times_of_sending_and_arrival(source, subscription):
    send = source.sender(DISPLACEMENT)
    raw = ScalarsLayout(DISPLACEMENT).pack(5, (0.001,))
    wait_until(lambda: subscription.get_publisher_count() and not source.unmatched(), 'connection')
    take = raw_taker(subscription)
    assert take() is None
    send(raw)
    taken, times = wait_until(take, 'arrival')
    assert taken == raw
    assert 0 < times['source_timestamp'] <= times['received_timestamp']


def test_parameters_given_at_the_start_are_known_also_where_they_equal_the_default(context):
    node = Node('given', context=context, parameter_overrides=[Parameter('one', value=1)])
    assert hasattr(node, '_parameter_overrides'), CHANGED.format('Node._parameter_overrides')
    node.declare_parameter('one', 1)
    node.declare_parameter('two', 2)
    assert given_at_start(node) == {'one'}
    node.destroy_node()


class Watched(OpenLifecycleNode):
    """Notes which transitions it was asked for."""

    asked: tuple[int, ...] = ()

    def change_state(self, transition_id):
        self.asked += (transition_id,)
        return super().change_state(transition_id)


def test_a_transition_can_be_overridden_and_the_services_end_with_the_node(context):
    node = Watched('watched', context=context)
    assert hasattr(node, '_state_machine'), CHANGED.format('LifecycleNode._state_machine')
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.asked == (Transition.TRANSITION_CONFIGURE,)
    node.destroy_node()
    del node
    gc.collect()  # the fixture `context` fails where the node stays in the graph
