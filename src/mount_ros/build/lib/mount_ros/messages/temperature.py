"""The coil's temperature as `sensor_msgs/Temperature`, in degC as that type demands."""

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Temperature

from mount_ros.messages.scalars import OneNumberLayout, stamp_of


def temperature_layout() -> OneNumberLayout:
    """Return what packs a stamp (ns) and a temperature (degC); the variance stays 0, which means unknown."""
    return OneNumberLayout(Temperature(), 'temperature')


def temperature_of(raw: bytes) -> tuple[int, float]:
    """Return stamp (ns) and temperature (degC) of a serialised message."""
    message = deserialize_message(raw, Temperature)
    return stamp_of(raw), float(message.temperature)
