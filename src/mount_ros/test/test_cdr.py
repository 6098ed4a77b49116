"""Our CDR bytes against the middleware's own serialiser."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout, String

from mount_ros.messages.cdr import serialised

texts = st.text(st.characters(exclude_characters='\x00', codec='utf-8'), max_size=12)
numbers = st.lists(st.floats(allow_nan=False), max_size=5)


@given(names=st.lists(texts, max_size=4), positions=numbers, velocities=numbers, frame=texts)
def test_joint_states_survive_the_middlewares_reader(names, positions, velocities, frame):
    message = JointState(name=names, position=positions, velocity=velocities)
    message.header.frame_id = frame
    assert deserialize_message(serialised(message), JointState) == message


@pytest.mark.parametrize(
    'message',
    [
        String(data='scenario: bench'),
        WrenchStamped(),
        Imu(orientation_covariance=[float(number) for number in range(9)]),
        Float64MultiArray(
            layout=MultiArrayLayout(dim=[MultiArrayDimension(label='rows', size=2, stride=4)]),
            data=[1.0, 2.0],
        ),
        DiagnosticArray(
            status=[DiagnosticStatus(level=b'\x02', name='a', values=[KeyValue(key='b', value='c')])]
        ),
    ],
)
def test_all_our_types_survive_without_a_byte_too_many(message):
    raw = serialised(message)
    assert deserialize_message(raw, type(message)) == message
    assert 0 <= len(serialize_message(message)) - len(raw) < 8 + 4, 'the middleware only adds to the end'


def test_padding_is_zero_where_the_middleware_leaves_what_was_there():
    message = JointState(name=['mount'], position=[0.0])
    message.header.frame_id = 'abcd'  # five bytes with its end: three bytes of padding behind it
    raw = serialised(message)
    end_of_text = raw.index(b'abcd\x00') + 5
    assert raw[end_of_text : end_of_text + 3] == bytes(3)
