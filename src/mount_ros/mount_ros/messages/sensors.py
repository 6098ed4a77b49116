"""Messages of single sensors: the coil's temperature, and an accelerometer on the chassis."""

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, Temperature

from mount_ros.messages.scalars import OneNumberLayout, stamp_of

_UNKNOWN = -1.0  # first covariance of what an Imu does not measure, by the definition of sensor_msgs/Imu


def temperature_layout() -> OneNumberLayout:
    """Return what packs a stamp (ns) and a temperature (degC); the variance stays 0, which means unknown."""
    return OneNumberLayout(Temperature(), 'temperature')


def temperature_of(raw: bytes) -> tuple[int, float]:
    """Return stamp (ns) and temperature (degC) of a serialised message."""
    return stamp_of(raw), float(deserialize_message(raw, Temperature).temperature)


def level_imu() -> Imu:
    """Return the message of an accelerometer that knows neither orientation nor rotation."""
    message = Imu()
    message.header.frame_id = 'mount_chassis'
    message.orientation_covariance[0] = message.angular_velocity_covariance[0] = _UNKNOWN
    return message
