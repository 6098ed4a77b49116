"""Under which topic a quantity is recorded, and as which bytes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.quantities import Quantity
from engine_mount.signals.signal import FloatArray
from mount_ros import topics
from mount_ros.messages.cdr import accelerometer
from mount_ros.messages.scalars import OneNumberLayout, Rows, ScalarsLayout
from mount_ros.topics import JOINT_STATE, Delivery, Scalar, Topic

PREFIX = 'measured/'
"""What the topics begin with that only recordings of others have."""


@dataclass(frozen=True)
class RecordedAs:
    """The topic and the field of its messages that hold a quantity."""

    topic: Topic
    field: str

    def rows(self, stamps: NDArray[np.int64], values: FloatArray) -> Rows:
        """Return the messages of `stamps` (ns) and `values` (n,), SI, as bytes."""
        if self.topic.type == JOINT_STATE:
            return ScalarsLayout(self.topic).pack_rows(stamps, values[:, None])
        return OneNumberLayout(accelerometer).pack_rows(stamps, values)


def recorded_as(quantity: Quantity) -> RecordedAs:
    """Return where `quantity` is recorded: displacement and acceleration where every command takes them."""
    if quantity.name == 'displacement':
        return RecordedAs(topics.DISPLACEMENT, topics.DISPLACEMENT.names[0])
    if quantity.name == 'acceleration':
        return RecordedAs(topics.SIM_CHASSIS_ACCELERATION, 'linear_acceleration.z')
    scalar = Scalar(quantity.name, quantity.unit.symbol)
    topic = Topic(PREFIX + quantity.name, JOINT_STATE, Delivery.STREAM, 0.0, quantity.sentence, (scalar,))
    return RecordedAs(topic, quantity.name)
