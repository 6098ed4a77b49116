"""The node `mount_recorder`: records the topics of the graph into one rosbag2 MCAP bag."""

import shutil
import time
from functools import partial
from pathlib import Path

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from mount_bags.diagnosis import OnFull, RecorderState, judge
from mount_bags.offered_qos import OfferedQos
from mount_bags.recording import Recorder
from mount_bags.writer import BagWriter, RecordingError
from mount_ros.collector import Collector
from mount_ros.diagnostics import Verdict
from mount_ros.lifecycle import SafeLifecycleNode
from mount_ros.process import run_node
from mount_ros.scalars import stamp_of
from mount_ros.topics import CURRENT_SETPOINT, TOPICS, Delivery, Topic, topic

_PARAMETERS = {
    'uri': ('', 'folder that the recording creates; it must not exist'),
    'topics': ([entry.name for entry in TOPICS], 'names of registered topics to record'),
    'on_full': (OnFull.STOP.value, 'what a full disk means for the run: stop (an error) or continue'),
}


class MountRecorder(SafeLifecycleNode):
    """Receives from `configure` on, records from `activate` to `deactivate`."""

    def __init__(self, **arguments):
        super().__init__('mount_recorder', **arguments)
        for name, (default, meaning) in _PARAMETERS.items():
            self.declare_parameter(name, default, ParameterDescriptor(description=meaning))
        self._writer: BagWriter | None = None
        self._recorder: Recorder | None = None
        self._subscriptions_by_topic: dict[str, Subscription] = {}
        self._on_full = OnFull.STOP
        self._announced_failure = ''
        self._begun_at = 0.0

    def configure(self) -> None:
        self._on_full = _on_full(self.get_parameter('on_full').value)
        topics = [_registered(name) for name in self.get_parameter('topics').value]
        uri = self.get_parameter('uri').value
        if not uri:
            raise RecordingError('parameter uri is empty; name the folder that the recording shall create')
        self._writer = BagWriter(Path(uri).expanduser().absolute())
        self._recorder = Recorder(self._writer)
        self._announced_failure = ''
        collector = self.open_collector()
        for entry in topics:
            self._record(collector, entry)
        collector.start()

    def activate(self) -> None:
        self._present_recorder().begin()
        self._begun_at = time.monotonic()
        self.get_logger().info(f'recording to {self._present_writer().folder}')

    def deactivate(self) -> None:
        recorder = self._present_recorder()
        if not recorder.begun:
            return
        recorder.end()
        figures, folder = recorder.figures(), self._present_writer().folder
        self.get_logger().info(
            f'recorded {figures.kept} messages, {figures.file_size} bytes, to {folder}; {figures.lost} lost'
        )

    def cleanup(self) -> None:
        self._subscriptions_by_topic = {}
        if self._recorder is not None and self._recorder.begun:
            self._recorder.end()
        elif self._writer is not None:
            self._writer.discard()
        self._writer = self._recorder = None

    def judge(self) -> Verdict:
        recorder, folder = self._present_recorder(), self._present_writer().folder
        figures = recorder.figures()
        if figures.failure and not self._announced_failure:
            self._announced_failure = figures.failure
            self.get_logger().error(figures.failure)
        elapsed = time.monotonic() - self._begun_at
        publishers = {
            name: entry.get_publisher_count() for name, entry in self._subscriptions_by_topic.items()
        }
        free = shutil.disk_usage(folder).free
        rate = figures.file_size / elapsed if elapsed > 1.0 else 0.0
        state = RecorderState(str(folder), figures, publishers, recorder.watches, free, rate)
        return judge(state, self._on_full)

    def _record(self, collector: Collector, entry: Topic) -> None:
        writer, recorder = self._present_writer(), self._present_recorder()
        name = collector.node.resolve_topic_name(entry.name)
        writer.add_topic(name, entry.type, partial(_offers, collector, name))
        # Setpoints pause between initialisation and control; the audit knows when, a live count does not.
        if entry.delivery is Delivery.STREAM and entry is not CURRENT_SETPOINT:
            recorder.watch(name, entry.rate, stamp_of)
        latched = entry.delivery is Delivery.LATCHED
        receive = recorder.latched_receiver(name) if latched else recorder.receiver(name)
        self._subscriptions_by_topic[name] = collector.collect(entry, receive)

    def _present_writer(self) -> BagWriter:
        if self._writer is None:
            raise RecordingError('the recorder is not configured')
        return self._writer

    def _present_recorder(self) -> Recorder:
        if self._recorder is None:
            raise RecordingError('the recorder is not configured')
        return self._recorder


def main() -> None:
    """Run the recorder until SIGINT or SIGTERM."""
    run_node(MountRecorder)


def _registered(name: str) -> Topic:
    try:
        return topic(name)
    except KeyError as error:
        raise RecordingError(f'parameter topics: {error.args[0]}') from None


def _on_full(word: str) -> OnFull:
    try:
        return OnFull(word)
    except ValueError:
        raise RecordingError(f'on_full must be stop or continue; instead received {word!r}') from None


def _offers(collector: Collector, topic_name: str) -> list[OfferedQos]:
    try:
        return [
            _offer(entry.qos_profile) for entry in collector.node.get_publishers_info_by_topic(topic_name)
        ]
    except RuntimeError:  # rclpy's errors of a context that is already shut down
        return []


def _offer(qos: QoSProfile) -> OfferedQos:
    return OfferedQos(
        history=qos.history.name.lower(),
        depth=qos.depth,
        reliability=qos.reliability.name.lower(),
        durability=qos.durability.name.lower(),
        deadline=qos.deadline.nanoseconds,
        lifespan=qos.lifespan.nanoseconds,
        liveliness=qos.liveliness.name.lower(),
        liveliness_lease_duration=qos.liveliness_lease_duration.nanoseconds,
        avoid_ros_namespace_conventions=qos.avoid_ros_namespace_conventions,
    )
