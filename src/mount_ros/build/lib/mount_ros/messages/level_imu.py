"""The message of an accelerometer on the chassis."""

from sensor_msgs.msg import Imu

_UNKNOWN = -1.0  # first covariance of what an Imu does not measure, by the definition of sensor_msgs/Imu


def level_imu() -> Imu:
    """Return the message of an accelerometer that knows neither orientation nor rotation."""
    message = Imu()
    message.header.frame_id = 'mount_chassis'
    message.orientation_covariance[0] = _UNKNOWN
    message.angular_velocity_covariance[0] = _UNKNOWN
    return message
