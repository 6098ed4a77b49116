"""Samples whose numbers are known, and recordings of them, for the tests of writer and reader."""

from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import COIL_RIPPLE, CURRENT_SETPOINT, DISPLACEMENT, Topic

START = 1_700_000_000_000_000_000  # ns, any time
PERIOD = 1_000_000  # ns
RECORDED = (DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT)


def write_drive(folder: Path, count: int, skipped: range = range(0), **options) -> Path:
    """Write `count` samples of three topics; the displacements in `skipped` are left out."""
    writer = BagWriter(folder, **options)
    for topic in RECORDED:
        writer.add_topic(f'/{topic.name}', topic.type)
    for index in range(count):
        for topic in RECORDED:
            if topic is DISPLACEMENT and index in skipped:
                continue
            stamp = START + index * PERIOD
            writer.write(f'/{topic.name}', sample(topic, index), stamp + 200_000)
    writer.close()
    return folder


def by_rosbags(folder: Path) -> list[tuple[str, int, bytes]]:
    """Return topic, time of reception (ns) and bytes of each message, as `rosbags` reads them."""
    with Reader(folder) as reader:
        return [(connection.topic, time, bytes(raw)) for connection, time, raw in reader.messages()]


def sample(topic: Topic, index: int) -> bytes:
    """Return the message of the sample `index`; its numbers are told by the index and their place.

    Serialised without the middleware, so that every byte is defined.
    """
    positions = np.array([index + place / 8 for place in range(len(topic.names))])
    velocities = -positions if topic.has_derivatives else np.empty(0)
    return joint_state(START + index * PERIOD, list(topic.names), positions, velocities)


def joint_state(stamp: int, names: list[str], positions: np.ndarray, velocities: np.ndarray) -> bytes:
    """Return a `JointState` of time `stamp` (ns)."""
    types = _STORE.types
    seconds, nanoseconds = divmod(stamp, 1_000_000_000)
    time = types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
    message = types['sensor_msgs/msg/JointState'](
        header=types['std_msgs/msg/Header'](stamp=time, frame_id=''),
        name=names,
        position=positions,
        velocity=velocities,
        effort=np.empty(0),
    )
    return bytes(_STORE.serialize_cdr(message, 'sensor_msgs/msg/JointState'))


_STORE = get_typestore(Stores.ROS2_JAZZY)
