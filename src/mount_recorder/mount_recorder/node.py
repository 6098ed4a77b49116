"""The node `mount_recorder`: records the topics of the graph into rosbag2 MCAP bags."""

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import String
from std_srvs.srv import Trigger

from mount_recorder.automatic_marks import AutomaticMarks, MarkKind, mark_kinds
from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.collector import Collector
from mount_recorder.diagnosis import Counted, OnFull, RecorderState, judge, unobserved_sentence
from mount_recorder.metadata import OfferedQos
from mount_recorder.parameters import RecorderParameters, split_of
from mount_recorder.recorder import Recorder, Unobserved
from mount_recorder.snapshot import Snapshot, SnapshotRule
from mount_recorder.space import SpaceGuard
from mount_recorder.watching import present_time, watch_topic
from mount_ros.messages.cdr import serialised
from mount_ros.messages.event import BY_HAND, Mark, mark_text
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node
from mount_ros.nodes.real_time import RealTimeThreads
from mount_ros.topics import EVENT, TOPICS, Delivery, Topic, topic

NAME = 'mount_recorder'
_MARKS_LOGGED = 10  # chosen: of those set by itself between two reports
_FAMILY = 'mount_record'  # all recorders are called so or something longer
_PLACES = {
    'uri': ('', 'folder that the recording creates; it must not exist'),
    'mounts': ('', 'namespaces of the mounts to record, as in left,right; empty: one mount in its own'),
    'topics': ([entry.name for entry in TOPICS], 'names of registered topics to record'),
}


class _Parts(NamedTuple):
    """What exists from `configure` to `cleanup`."""

    parameters: RecorderParameters
    on_full: OnFull
    data_path: Collector
    sink: BagWriter | Snapshot
    recorder: Recorder
    space: SpaceGuard
    marks: AutomaticMarks
    event: str
    """Full name of the topic of the marks."""
    send_event: Callable[[bytes], None]
    subscriptions: dict[str, Subscription]


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
        self._configured: _Parts | None = None
        self._logged_failure = ''
        self._logged_malformed: set[str] = set()
        self._unlogged_marks: deque[str] = deque(maxlen=_MARKS_LOGGED)
        self._counted = SlidingWindow(Counted())
        self._began_at = 0.0
        self._mark_service = self.create_service(
            Trigger, '~/mark', self._on_mark, callback_group=self.transitions
        )

    def configure(self) -> None:
        parameters = read(self, RecorderParameters())
        on_full = _on_full(parameters.on_full)
        topics = [_registered(name) for name in self.get_parameter('topics').value]
        mounts = [name.strip() for name in self.get_parameter('mounts').value.split(',')]
        uri = self.get_parameter('uri').value
        if not uri:
            raise RecordingError('parameter uri is empty; name the folder that the recording shall create')
        kinds = mark_kinds(parameters.automatic_marks)
        folder = Path(uri).expanduser().absolute()
        space = SpaceGuard(folder, parameters.free_reserve)
        if shortage := space.shortage():
            raise RecordingError(f'recording {folder} cannot be started: {shortage}')
        thread = self.data_thread if self.lockstep else None
        self.data_path = data_path = Collector(self, thread=thread, on_failure=self.report_failure)
        event = data_path.node.resolve_topic_name(EVENT.name)
        sink = _open_sink(folder, parameters, event, topics)
        marks = AutomaticMarks(self._publish_automatic, kinds)
        recorder = Recorder(sink, threaded=not self.lockstep, space=space, on_loss=self._mark_loss)
        send_event = data_path.sender(EVENT)
        self._configured = _Parts(
            parameters, on_full, data_path, sink, recorder, space, marks, event, send_event, {}
        )
        self._logged_failure = ''
        self._logged_malformed = set()
        for entry in topics:
            common = entry.name.startswith('/') or mounts == ['']
            for mount in [''] if common else mounts:
                self._record(entry, mount)
        if mounts != [''] and EVENT in topics:
            self._record(EVENT, '')  # marks of the recorder itself, which concern all mounts
        if self.lockstep:
            data_path.add_poll(recorder.poll)
        data_path.start()

    def activate(self) -> None:
        self._parts.recorder.begin()
        self._counted = SlidingWindow(Counted())
        self._began_at = time.monotonic()
        self.get_logger().info(f'recording to {self._parts.sink.folder}')

    def deactivate(self) -> None:
        recorder, sink = self._parts.recorder, self._parts.sink
        if not recorder.begun:
            return
        recorder.end()
        figures = recorder.figures()
        places = sink.folders if isinstance(sink, Snapshot) else [sink.folder]
        where = ', '.join(map(str, places)) or 'nowhere, for lack of an event'
        self.get_logger().info(
            f'recorded {figures.kept} messages, {figures.file_size} bytes, to {where}; {figures.lost} lost'
        )

    def cleanup(self) -> None:
        if self._configured is not None:
            if self._configured.recorder.begun:
                self._configured.recorder.end()
            else:
                self._configured.sink.discard()
        self._configured = None

    def judge(self) -> Verdict:
        parts = self._parts
        recorder, sink, figures = parts.recorder, parts.sink, parts.recorder.figures()
        unobserved = dict(recorder.unobserved)
        self._log_news(figures.failure, unobserved)
        elapsed = time.monotonic() - self._began_at
        state = RecorderState(
            str(sink.folder),
            figures,
            {name: entry.get_publisher_count() for name, entry in parts.subscriptions.items()},
            recorder.watches,
            parts.space.free(),
            figures.file_size / elapsed if elapsed > 1.0 else 0.0,
            recorder.overflowed(),
            unobserved,
            parts.marks.sent,
            recorder.received_on(parts.event),
            sink.figures() if isinstance(sink, Snapshot) else None,
        )
        return judge(state, parts.on_full, self._counted.earlier(time.monotonic(), state.counted))

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
    def _parts(self) -> _Parts:
        if self._configured is None:
            raise RecordingError('the recorder is not configured')
        return self._configured

    def _record(self, entry: Topic, mount: str) -> None:
        parts = self._parts
        placed = replace(entry, name=f'{mount}/{entry.name}') if mount else entry
        name = parts.data_path.node.resolve_topic_name(placed.name)
        latched = entry.delivery is Delivery.LATCHED
        parts.sink.add_topic(name, entry.type, partial(_offers, parts.data_path, name), latched=latched)
        rate, namespace = parts.parameters.sample_rate, self.get_namespace()
        watch_topic(parts.recorder, entry, name, parts.marks, namespace, self._present_time, rate)
        receive = (parts.recorder.latched_receiver if latched else parts.recorder.receiver)(name)
        parts.subscriptions[name] = parts.data_path.collect(placed, receive)

    def _log_news(self, failure: str, unobserved: Mapping[str, Unobserved]) -> None:
        """Log what is new since the last report: a failure, marks, kinds of malformed messages."""
        if failure and not self._logged_failure:
            self._logged_failure = failure
            self.get_logger().error(failure)
        if marks := [self._unlogged_marks.popleft() for _ in range(len(self._unlogged_marks))]:
            self.get_logger().info(f'marked: {"; ".join(marks)}')
        if new := {name: unobserved[name] for name in unobserved.keys() - self._logged_malformed}:
            self._logged_malformed |= new.keys()
            self.get_logger().warning(unobserved_sentence(new))

    # Marks.

    def _present_time(self) -> int:
        return present_time(self.get_clock().now().nanoseconds, self._parts.recorder.last_stamp)

    def _mark_loss(self, count: int) -> None:
        text = f'{count} messages not recorded: the disk was slower than the data'
        self._parts.marks.mark(MarkKind.RECORDING_LOSS, self._present_time(), text)

    def _publish(self, mark: Mark) -> None:
        self._parts.send_event(serialised(String(data=mark_text(mark))))

    def _publish_automatic(self, mark: Mark) -> None:
        """Publish a mark unless another recorder of this namespace does: of several the first by name."""
        node = self._parts.data_path.node
        try:
            infos = node.get_publishers_info_by_topic(EVENT.name)
            names = [info.node_name for info in infos if info.node_name.startswith(_FAMILY)]
            if min(names, default=node.get_name()) >= node.get_name():
                self._publish(mark)
                self._unlogged_marks.append(f'{mark.kind}, {mark.text}')
        except RuntimeError:  # rclpy's errors of a context that is already shut down
            return


def main() -> None:
    """Run the recorder until SIGINT or SIGTERM."""
    run_node(MountRecorder)


def _open_sink(
    folder: Path, parameters: RecorderParameters, event: str, topics: list[Topic]
) -> BagWriter | Snapshot:
    # What belongs together in a file is told by the steady clock: the system's, of the log times, may step.
    open_writer = partial(BagWriter, split=split_of(parameters), clock=time.monotonic_ns)
    if not parameters.snapshot:
        return open_writer(folder)
    if EVENT not in topics:
        raise RecordingError(f'a snapshot is set off by the topic {EVENT.name}; name it among the topics')
    before, after = round(1e9 * parameters.snapshot), round(1e9 * parameters.snapshot_after)
    return Snapshot(folder, event, SnapshotRule(before, after, parameters.snapshot_memory), open_writer)


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
    policies = ('history', 'reliability', 'durability', 'liveliness')
    durations = ('deadline', 'lifespan', 'liveliness_lease_duration')
    return OfferedQos(
        depth=qos.depth,
        avoid_ros_namespace_conventions=qos.avoid_ros_namespace_conventions,
        **{name: getattr(qos, name).name.lower() for name in policies},
        **{name: getattr(qos, name).nanoseconds for name in durations},
    )
