"""The coil's temperature on its way through a message."""

from rclpy.serialization import deserialize_message

from mount_ros.messages.cdr import message_class, serialised
from mount_ros.messages.sensors import temperature_layout, temperature_of
from mount_ros.topics import COIL_TEMPERATURE

STAMP = 5_123_456_789


def test_a_temperature_is_told_in_degrees_celsius_of_the_registered_type():
    raw = temperature_layout().pack(STAMP, 36.6)
    message = deserialize_message(raw, message_class(COIL_TEMPERATURE.type))
    assert message.temperature == 36.6
    assert message.variance == 0.0
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (5, 123_456_789)
    assert serialised(message) == raw


def test_what_was_packed_comes_back():
    assert temperature_of(temperature_layout().pack(STAMP, -12.3)) == (STAMP, -12.3)
