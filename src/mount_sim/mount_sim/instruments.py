"""What of a simulated mount stands on topics: the truth and the instruments of the test rack."""

from dataclasses import replace

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Imu

from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import Topic

_UNKNOWN_ORIENTATION = -1.0  # sensor_msgs/Imu: first element of a covariance


class Instruments:
    """Publishes truth, acceleration and force of one mount, the one `name` of several or the only one."""

    def __init__(self, path: DataPath, name: str = ''):
        def of_mount(topic: Topic) -> Topic:
            return replace(topic, name=f'{name}/{topic.name}') if name else topic

        self._truth = ScalarsLayout(topics.SIM_TRUTH)
        self._acceleration = OneNumberLayout(level_imu(), 'linear_acceleration.z')
        self._force = OneNumberLayout(WrenchStamped(), 'wrench.force.z')
        self._send_truth = path.sender(of_mount(topics.SIM_TRUTH))
        self._send_acceleration = path.sender(of_mount(topics.SIM_CHASSIS_ACCELERATION))
        self._send_force = path.sender(of_mount(topics.SIM_MOUNT_FORCE))

    def publish(self, stamp: int, truth: np.void, truth_bytes: bytes) -> None:
        """Publish what was true at the time `stamp` (ns)."""
        self._send_truth(self._truth.pack_record(stamp, truth_bytes))
        self._send_acceleration(self._acceleration.pack(stamp, truth['chassis_acceleration']))
        self._send_force(self._force.pack(stamp, truth['mount_force']))


def level_imu() -> Imu:
    """Return the message of an accelerometer that knows neither orientation nor rotation."""
    message = Imu()
    message.header.frame_id = 'mount_chassis'
    message.orientation_covariance[0] = _UNKNOWN_ORIENTATION
    message.angular_velocity_covariance[0] = _UNKNOWN_ORIENTATION
    return message
