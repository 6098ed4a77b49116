"""Fixed-layout messages against the general deserialiser."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from mount_ros.messages.cdr import wrench
from mount_ros.messages.scalars import MessageError, OneNumberLayout, ScalarsLayout, ScalarsReader, stamp_of
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, DISPLACEMENT, control_trace

STAMP = 1_763_680_000_123_456_789
stamps = st.integers(0, 2**31 * 1_000_000_000 - 1)
floats = st.floats(allow_nan=False)


@given(stamp=stamps, numbers=st.tuples(floats, floats), slopes=st.tuples(floats, floats))
def test_packed_messages_are_what_the_middleware_reads(stamp, numbers, slopes):
    raw = ScalarsLayout(COIL_RIPPLE).pack(stamp, numbers, slopes)
    assert ScalarsLayout(COIL_RIPPLE).unpack(raw) == (stamp, numbers, slopes)
    message = deserialize_message(raw, JointState)
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
    assert tuple(message.name) == COIL_RIPPLE.names
    assert (tuple(message.position), tuple(message.velocity)) == (numbers, slopes)


def test_a_record_is_packed_in_the_order_of_the_names():
    layout = ScalarsLayout(CONTROL_TRACE)
    numbers = tuple(float(place) for place in range(len(layout.names)))
    message = ScalarsLayout(CONTROL_TRACE).pack(STAMP, numbers)
    assert message == layout.pack_record(STAMP, np.array(numbers).tobytes())


def test_a_foreign_order_of_names_is_read_by_name():
    message = JointState(name=['flux_density', 'other', 'coil_current'], position=[1.0, 2.0, 3.0])
    message.velocity = [4.0, 5.0, 6.0]
    message.header.frame_id = 'somewhere'
    message.header.stamp.sec = 7
    stamp, positions, velocities = ScalarsLayout(COIL_RIPPLE).unpack(serialize_message(message))
    assert (stamp, positions, velocities) == (7_000_000_000, (3.0, 1.0), (6.0, 4.0))
    message.velocity = []
    assert all(map(math.isnan, ScalarsLayout(COIL_RIPPLE).unpack(serialize_message(message))[2]))


def test_a_reader_takes_names_from_messages_of_any_layout():
    reader = ScalarsReader(('current', 'magnitude'))
    named = (('current',), ('x', 'magnitude', 'current'))
    short, long = (ScalarsLayout(control_trace(names)) for names in named)
    assert reader.read(long.pack(STAMP, (1.0, 2.0, 3.0))) == (STAMP, [3.0, 2.0])
    stamp, (current, magnitude) = reader.read(short.pack(STAMP, (7.0,)))
    assert (stamp, current) == (STAMP, 7.0)
    assert math.isnan(magnitude)


def test_a_message_without_the_declared_name_is_refused():
    message = JointState(name=['throttle'], position=[1.0])
    with pytest.raises(MessageError, match=r"displacement: the message names \['throttle'\]"):
        ScalarsLayout(DISPLACEMENT).unpack(serialize_message(message))


@given(stamp=stamps, number=floats)
def test_one_number_layouts_change_stamp_and_number_only(stamp, number):
    raw = OneNumberLayout(wrench).pack(stamp, number)
    message = deserialize_message(raw, WrenchStamped)
    assert (stamp_of(raw), message.wrench.force.z) == (stamp, number)
    assert (message.wrench.force.x, message.wrench.torque.z) == (0.0, 0.0)


@given(entries=st.lists(st.tuples(stamps, st.tuples(floats, floats), st.tuples(floats, floats)), max_size=4))
def test_many_messages_packed_at_once_are_those_packed_one_by_one(entries):
    layout = ScalarsLayout(COIL_RIPPLE)
    moments = np.array([stamp for stamp, _, _ in entries], np.int64)
    positions = np.array([numbers for _, numbers, _ in entries]).reshape(-1, 2)
    velocities = np.array([slopes for _, _, slopes in entries]).reshape(-1, 2)
    rows = layout.pack_rows(moments, positions, velocities)
    assert [row.tobytes() for row in rows] == [layout.pack(*entry) for entry in entries]


def test_a_stamp_that_no_message_can_carry_is_refused():
    with pytest.raises(MessageError, match='stamps must lie within'):
        ScalarsLayout(DISPLACEMENT).pack_rows(np.array([0, 2**31 * 10**9]), np.zeros((2, 1)))
