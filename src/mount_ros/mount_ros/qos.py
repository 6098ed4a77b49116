"""Quality of service of each topic, publisher's and subscriber's side."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from mount_ros.topics import Delivery, Topic

CONTROL_DEPTH = 100  # chosen: 0.1 s; measured: 10 loses what comes while a host takes the processors away
STREAM_DEPTH = 5000  # chosen: five seconds of data for a recorder that the scheduler lets wait
MARK_DEPTH = 100  # chosen


def publisher_qos(topic: Topic) -> QoSProfile:
    """Return what the publisher of `topic` offers: always reliable, which suits every subscriber."""
    if topic.delivery is Delivery.LATCHED:
        return QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    return QoSProfile(depth=STREAM_DEPTH if topic.delivery is Delivery.STREAM else MARK_DEPTH)


def control_qos(topic: Topic, *, lockstep: bool) -> QoSProfile:
    """Return what a node of the control loop asks for: fresh data in real time, all data in lock-step."""
    if topic.delivery is Delivery.LATCHED:
        return publisher_qos(topic)
    reliability = ReliabilityPolicy.RELIABLE if lockstep else ReliabilityPolicy.BEST_EFFORT
    return QoSProfile(depth=CONTROL_DEPTH, reliability=reliability)
