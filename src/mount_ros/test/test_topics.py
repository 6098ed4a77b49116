"""The registry: what can be said of every topic without a node."""

import pytest
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy

from mount_ros.messages.cdr import message_class
from mount_ros.qos import CONTROL_DEPTH, control_qos, publisher_qos
from mount_ros.topics import DISPLACEMENT, JOINT_STATE, RACK_TOPICS, TOPICS, Delivery, topic

each_topic = pytest.mark.parametrize('entry', TOPICS + RACK_TOPICS, ids=lambda entry: entry.name)


def test_an_unknown_topic_is_refused_with_the_known_ones():
    with pytest.raises(KeyError, match="'displacment' is no topic of the graph; did you mean displacement"):
        topic('displacment')


@each_topic
def test_scalars_belong_to_joint_states_and_are_distinct(entry):
    assert message_class(entry.type).__name__ == entry.type.rpartition('/')[2]
    assert bool(entry.scalars) == (entry.type == JOINT_STATE)
    assert len(set(entry.names)) == len(entry.names)
    assert all(scalar.unit for scalar in entry.scalars)


@each_topic
@pytest.mark.parametrize('lockstep', [True, False])
def test_nobody_asks_for_more_than_is_offered(entry, lockstep):
    offered = publisher_qos(entry)
    for wanted in (control_qos(entry, lockstep=lockstep), publisher_qos(entry)):
        assert wanted.reliability in (offered.reliability, ReliabilityPolicy.BEST_EFFORT)
        assert wanted.durability in (offered.durability, DurabilityPolicy.VOLATILE)


@each_topic
def test_publishers_are_reliable_and_only_latched_ones_keep_the_last(entry):
    offered = publisher_qos(entry)
    assert offered.reliability is ReliabilityPolicy.RELIABLE
    assert offered.history is HistoryPolicy.KEEP_LAST
    latched = entry.delivery is Delivery.LATCHED
    assert (offered.durability is DurabilityPolicy.TRANSIENT_LOCAL) == latched


def test_the_loop_takes_fresh_data_in_real_time_and_all_data_in_lock_step():
    assert control_qos(DISPLACEMENT, lockstep=False).reliability is ReliabilityPolicy.BEST_EFFORT
    assert control_qos(DISPLACEMENT, lockstep=True).reliability is ReliabilityPolicy.RELIABLE
    assert control_qos(DISPLACEMENT, lockstep=False).depth == CONTROL_DEPTH


@pytest.mark.parametrize('name', ['sensor_msgs/msg/JointStates', 'no_such_msgs/msg/Some', ''])
def test_an_unknown_message_type_is_refused(name):
    with pytest.raises(ValueError, match='is not installed'):
        message_class(name)
