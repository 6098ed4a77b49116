"""The node `mount_recorder`: records the topics of the graph into rosbag2 MCAP bags."""

import time
from dataclasses import replace
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from mount_recorder.automatic_marks import AutomaticMarks, MarkKind, mark_kinds
from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.collector import Collector
from mount_recorder.diagnosis import Figures, OnFull, judge
from mount_recorder.metadata import Offers
from mount_recorder.parameters import RecorderParameters, check_split
from mount_recorder.recorder import Recorder, free_space
from mount_recorder.stamp_watch import StampWatch
from mount_recorder.watching import FaultWatch, SwitchWatch
from mount_ros.messages.cdr import string_message
from mount_ros.messages.event import BY_HAND, Mark, mark_text
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node
from mount_ros.nodes.real_time import RealTimeThreads
from mount_ros.topics import (
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DIAGNOSTICS,
    EVENT,
    SHADOW_TOPICS,
    TOPICS,
    Delivery,
    Topic,
    topic,
)

NAME = 'mount_recorder'
_HOUR = 3_600_000_000_000  # ns
_POLICIES = (
    *('history', 'depth', 'reliability', 'durability', 'deadline', 'lifespan', 'liveliness'),
    *('liveliness_lease_duration', 'avoid_ros_namespace_conventions'),
)
_PLACES = {
    'uri': ('', 'folder that the recording creates; it must not exist'),
    'mounts': ('', 'namespaces of the mounts to record, as in left,right; empty: one mount in its own'),
    'topics': ([entry.name for entry in TOPICS], 'names of registered topics to record'),
}


class MountRecorder(SafeLifecycleNode):
    """Receives from `configure` on, records from `activate` to `deactivate`."""

    run_time_parameters = frozenset({'mark_text'})
    # The collector; its queues hold seconds.
    real_time_threads = RealTimeThreads(frozenset({f'{NAME}_io'}), interpreter=False)

    def __init__(self, name: str = NAME, **arguments):
        super().__init__(name, **arguments)
        for parameter, (default, meaning) in _PLACES.items():
            self.declare_parameter(parameter, default, ParameterDescriptor(description=meaning))
        declare(self, RecorderParameters())
        self._recorder: Recorder | None = None
        self._mark_service = self.create_service(Trigger, '~/mark', self._on_mark)

    # What is set here exists until `cleanup`.
    def configure(self) -> None:
        self._settings = parameters = read(self, RecorderParameters())
        topics = [_registered(name) for name in self.get_parameter('topics').value]
        topics += SHADOW_TOPICS if parameters.shadow else ()
        mounts = [name.strip() for name in self.get_parameter('mounts').value.split(',')]
        uri = self.get_parameter('uri').value
        if not uri:
            raise RecordingError('parameter uri is empty; name the folder that the recording shall create')
        self._on_full = _on_full(parameters.on_full)
        self._marks = AutomaticMarks(self._publish, mark_kinds(parameters.automatic_marks))
        data_path = Collector(self, on_failure=self.report_failure)
        self.data_path = self._collector = data_path
        self._event = data_path.node.resolve_topic_name(EVENT.name)
        self._send_event = data_path.sender(EVENT)
        check_split(parameters.split_size)
        self._recorder = Recorder(
            Path(uri).expanduser().absolute(),
            open_writer=partial(BagWriter, split_size=parameters.split_size),
            free_reserve=parameters.free_reserve,
            on_loss=self._mark_loss,
        )
        self._subscriptions_by_topic: dict[str, Subscription] = {}
        self._switches: dict[str, SwitchWatch] = {}
        self._logged_failure = ''
        for entry in topics:
            common = entry.name.startswith('/') or mounts == ['']
            for mount in [''] if common else mounts:
                self._record(entry, mount)
        if mounts != [''] and EVENT in topics:
            self._record(EVENT, '')  # marks of the recorder itself, which concern all mounts
        data_path.start()

    def activate(self) -> None:
        self._core.begin()
        self._counted = SlidingWindow[Figures]({})
        self._began_at = time.monotonic()
        self.get_logger().info(f'recording to {self._core.folder}')

    def deactivate(self) -> None:
        recorder = self._core
        if not recorder.begun:
            return
        recorder.end()
        figures = recorder.figures()
        self.get_logger().info(
            f'recorded {figures["kept"]} messages, {figures["file_bytes"]} bytes, '
            f'to {recorder.folder}; {figures["lost"]} lost'
        )

    def cleanup(self) -> None:
        if self._recorder is not None:
            if self._recorder.begun:
                self._recorder.end()
            else:
                self._recorder.discard()
        self._recorder = None

    def judge(self) -> Verdict:
        recorder = self._core
        figures = self._figures(recorder)
        if recorder.failure != self._logged_failure:
            self._logged_failure = recorder.failure
            self.get_logger().error(recorder.failure)
        return judge(
            figures,
            self._counted.earlier(time.monotonic(), figures),
            recorder.unobserved,
            failure=recorder.failure,
            on_full=self._on_full,
        )

    def mark(self, text: str = '', kind: str = BY_HAND) -> Mark:
        """Publish a mark of this moment on `event` and return it; raises `RecordingError` unless active."""
        if not self.active:
            raise RecordingError(f'{self.get_name()} is not active; nothing would be marked')
        mark = Mark(self._present_time(), kind, text)
        self._publish(mark)
        self.get_logger().info(f'marked: {text or kind}')
        return mark

    def _on_mark(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            mark = self.mark(self.get_parameter('mark_text').value)
            response.success, response.message = True, f'marked at {mark.time / 1e9:.3f} s'
        except RecordingError as error:
            response.message = str(error)
        return response

    @property
    def _core(self) -> Recorder:
        if self._recorder is None:
            raise RecordingError('the recorder is not configured')
        return self._recorder

    def _record(self, entry: Topic, mount: str) -> None:
        placed = replace(entry, name=f'{mount}/{entry.name}') if mount else entry
        name = self._collector.node.resolve_topic_name(placed.name)
        latched = entry.delivery is Delivery.LATCHED
        offers = partial(_offers, self._collector, name)
        receive = self._core.add_topic(name, entry.type, offers, latched=latched)
        self._watch(entry, name, mount)
        self._subscriptions_by_topic[name] = self._collector.collect(placed, receive)

    def _watch(self, entry: Topic, name: str, mount: str) -> None:
        recorder = self._core
        if entry is DIAGNOSTICS:
            faults = FaultWatch(self._marks, self.get_namespace(), self._present_time)
            recorder.observers[name] = faults.observe
        # Setpoints pause between initialisation and control; the audit knows when, a live count does not.
        elif entry.delivery is Delivery.STREAM and entry.rate and entry is not CURRENT_SETPOINT:
            rate = entry.rate_at(self._settings.sample_rate)
            stamps = recorder.watches[name] = StampWatch(rate)
            recorder.observers[name] = stamps.observe
            if entry is CONTROL_TRACE:
                switch = self._switches[mount] = SwitchWatch(self._marks, stamps, mount)
                recorder.observers[name] = switch.observe

    def _figures(self, recorder: Recorder) -> dict[str, Any]:
        figures: dict[str, Any] = {'folder': str(recorder.folder), **recorder.figures()}
        elapsed = time.monotonic() - self._began_at
        receptions = recorder.receptions
        figures |= {
            'free_bytes': free_space(recorder.folder),
            'bytes_per_second': round(figures['file_bytes'] / elapsed) if elapsed > 1.0 else 0,
            'last_stamp': recorder.last_stamp,
            'marks': self._marks.sent,
            'events': receptions[self._event].received if self._event in receptions else 0,
        }
        figures |= {f'damping_off.{mount}'.rstrip('.'): each.off for mount, each in self._switches.items()}
        for name, subscription in self._subscriptions_by_topic.items():
            figures[f'publishers.{name}'] = subscription.get_publisher_count()
        return {**figures, **recorder.figures_by_topic()}

    # Marks.

    def _present_time(self) -> int:
        """Return "now" on the clock of the stamps, ns.

        It is the system's unless the stamps begin at 0, as in lock-step: then it is the stamp that came last.
        """
        clock, last_stamp = self.get_clock().now().nanoseconds, self._core.last_stamp
        return last_stamp if last_stamp and abs(clock - last_stamp) > _HOUR else clock

    def _mark_loss(self, count: int) -> None:
        text = f'{count} messages not recorded: the disk was slower than the data'
        self._marks.mark(MarkKind.RECORDING_LOSS, self._present_time(), text)

    def _publish(self, mark: Mark) -> None:
        self._send_event(string_message(mark_text(mark)))


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


def _offers(collector: Collector, topic_name: str) -> Offers:
    try:
        return [
            _offer(entry.qos_profile) for entry in collector.node.get_publishers_info_by_topic(topic_name)
        ]
    except RuntimeError:  # rclpy's errors of a context that is already shut down
        return []


def _offer(qos: QoSProfile) -> dict[str, Any]:
    """Return the policies as rosbag2 writes them, in its order."""
    return {name: _plain(getattr(qos, name)) for name in _POLICIES}


def _plain(value: Any) -> Any:
    if isinstance(value, Duration):
        seconds, rest = divmod(value.nanoseconds, 1_000_000_000)
        return {'sec': seconds, 'nsec': rest}
    return value.name.lower() if isinstance(value, Enum) else value
