"""Our CDR bytes against the middleware's own serialiser."""

import pytest
from geometry_msgs.msg import WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu, JointState, Temperature
from std_msgs.msg import String

from mount_ros.messages import cdr
from mount_ros.messages.cdr import CdrWriter, joint_state

texts = st.text(st.characters(exclude_characters='\x00', codec='utf-8'), max_size=12)
numbers = st.lists(st.floats(allow_nan=False), max_size=5)


@given(names=st.lists(texts, max_size=4), positions=numbers, velocities=numbers)
def test_joint_states_survive_the_middlewares_reader(names, positions, velocities):
    message = JointState(name=names, position=positions, velocity=velocities)
    assert deserialize_message(joint_state(names, positions, velocities), JointState) == message


def accelerometer() -> Imu:
    message = Imu()
    message.header.frame_id = 'mount_chassis'
    message.orientation_covariance[0] = message.angular_velocity_covariance[0] = -1.0
    message.linear_acceleration.z = 9.5
    return message


def wrench() -> WrenchStamped:
    message = WrenchStamped()
    message.wrench.force.z = 9.5
    return message


@pytest.mark.parametrize(
    ('raw', 'message'),
    [
        (cdr.string_message('scenario: bänch'), String(data='scenario: bänch')),
        (cdr.temperature(9.5), Temperature(temperature=9.5)),
        (cdr.wrench(9.5), wrench()),
        (cdr.accelerometer(9.5), accelerometer()),
    ],
)
def test_all_our_types_survive_without_a_byte_too_many(raw, message):
    assert deserialize_message(raw, type(message)) == message
    assert 0 <= len(serialize_message(message)) - len(raw) < 8 + 4, 'the middleware only adds to the end'


def test_padding_is_zero_where_the_middleware_leaves_what_was_there():
    raw = CdrWriter().header('abcd').numbers('d', 0.0).raw  # five bytes with its end: padding to eight
    end_of_text = raw.index(b'abcd\x00') + 5
    assert raw[end_of_text : end_of_text + 3] == bytes(3)
