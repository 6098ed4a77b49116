"""The node `mount_recorder`: records the topics of the graph into rosbag2 MCAP bags."""

import time
from collections import deque
from dataclasses import replace
from functools import partial
from pathlib import Path

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import String
from std_srvs.srv import Trigger

from mount_models.sampling import SAMPLE_RATE
from mount_recorder.automatic_marks import AutomaticMarks, MarkKind, mark_kinds
from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.collector import Collector
from mount_recorder.diagnosis import Counted, OnFull, RecorderState, judge, unobserved_sentence
from mount_recorder.offered_qos import OfferedQos
from mount_recorder.parameters import RecorderParameters, split_of
from mount_recorder.recorder import Recorder
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
_MARKS_TOLD = 10  # chosen: of those set by itself between two looks
_FAMILY = 'mount_record'  # all recorders are called so or something longer
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
        self._sink: BagWriter | Snapshot | None = None
        self._recorder: Recorder | None = None
        self._space: SpaceGuard | None = None
        self._marks: AutomaticMarks | None = None
        self._subscriptions_by_topic: dict[str, Subscription] = {}
        self._on_full = OnFull.STOP
        self._sample_rate = SAMPLE_RATE
        self._event = EVENT.name
        self._announced_failure = ''
        self._announced_malformed: set[str] = set()
        self._marked: deque[str] = deque(maxlen=_MARKS_TOLD)  # and not yet in the log
        self._counted = SlidingWindow(Counted())
        self._begun_at = 0.0
        self._mark_service = self.create_service(
            Trigger, '~/mark', self._on_mark, callback_group=self.transitions
        )

    def configure(self) -> None:
        parameters = read(self, RecorderParameters())
        self._on_full = _on_full(parameters.on_full)
        self._sample_rate = parameters.sample_rate
        topics = [_registered(name) for name in self.get_parameter('topics').value]
        mounts = [name.strip() for name in self.get_parameter('mounts').value.split(',')]
        uri = self.get_parameter('uri').value
        if not uri:
            raise RecordingError('parameter uri is empty; name the folder that the recording shall create')
        kinds = mark_kinds(parameters.automatic_marks)
        folder = Path(uri).expanduser().absolute()
        self._space = SpaceGuard(folder, parameters.free_reserve)
        if shortage := self._space.shortage():
            raise RecordingError(f'recording {folder} cannot be started: {shortage}')
        data_path = self._open_collector()
        event = data_path.node.resolve_topic_name(EVENT.name)
        self._sink = _sink(folder, parameters, event, topics)
        self._event = event
        self._send_event = data_path.sender(EVENT)
        self._marks = AutomaticMarks(partial(self._publish_automatic, data_path), kinds)
        self._recorder = Recorder(
            self._sink,
            threaded=not self.lockstep,
            space=self._space,
            on_loss=self._mark_loss,
        )
        self._announced_failure = ''
        self._announced_malformed = set()
        for entry in topics:
            common = entry.name.startswith('/') or mounts == ['']
            for mount in [''] if common else mounts:
                self._record(data_path, entry, mount)
        if mounts != [''] and EVENT in topics:
            self._record(data_path, EVENT, '')  # marks of the recorder itself, which concern all mounts
        if self.lockstep:
            data_path.add_poll(self._recorder.poll)
        data_path.start()

    def activate(self) -> None:
        self._present_recorder().begin()
        self._counted = SlidingWindow(Counted())
        self._begun_at = time.monotonic()
        self.get_logger().info(f'recording to {self._present_sink().folder}')

    def deactivate(self) -> None:
        recorder = self._present_recorder()
        if not recorder.begun:
            return
        recorder.end()
        figures, sink = recorder.figures(), self._present_sink()
        places = sink.folders if isinstance(sink, Snapshot) else [sink.folder]
        where = ', '.join(map(str, places)) or 'nowhere, for lack of an event'
        self.get_logger().info(
            f'recorded {figures.kept} messages, {figures.file_size} bytes, to {where}; {figures.lost} lost'
        )

    def cleanup(self) -> None:
        self._subscriptions_by_topic = {}
        if self._recorder is not None and self._recorder.begun:
            self._recorder.end()
        elif self._sink is not None:
            self._sink.discard()
        self._sink = self._recorder = self._marks = self._space = None

    def judge(self) -> Verdict:
        recorder, sink = self._present_recorder(), self._present_sink()
        figures = recorder.figures()
        if figures.failure and not self._announced_failure:
            self._announced_failure = figures.failure
            self.get_logger().error(figures.failure)
        if marked := [self._marked.popleft() for _ in range(len(self._marked))]:
            self.get_logger().info(f'marked: {"; ".join(marked)}')
        unobserved = dict(recorder.unobserved)
        if new := {name: unobserved[name] for name in unobserved.keys() - self._announced_malformed}:
            self._announced_malformed |= new.keys()
            self.get_logger().warning(unobserved_sentence(new))
        elapsed = time.monotonic() - self._begun_at
        state = RecorderState(
            str(sink.folder),
            figures,
            {name: entry.get_publisher_count() for name, entry in self._subscriptions_by_topic.items()},
            recorder.watches,
            self._space.free() if self._space is not None else 0,
            figures.file_size / elapsed if elapsed > 1.0 else 0.0,
            recorder.overflowed(),
            unobserved,
            self._marks.sent if self._marks is not None else 0,
            recorder.received_on(self._event),
            sink.figures() if isinstance(sink, Snapshot) else None,
        )
        return judge(state, self._on_full, self._counted.earlier(time.monotonic(), state.counted))

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

    def _open_collector(self) -> Collector:
        thread = self.data_thread if self.lockstep else None
        self.data_path = collector = Collector(self, thread=thread, on_failure=self.report_failure)
        return collector

    def _record(self, data_path: Collector, entry: Topic, mount: str) -> None:
        sink, recorder, marks = self._present_sink(), self._present_recorder(), self._marks
        assert marks is not None
        placed = replace(entry, name=f'{mount}/{entry.name}') if mount else entry
        name = data_path.node.resolve_topic_name(placed.name)
        latched = entry.delivery is Delivery.LATCHED
        sink.add_topic(name, entry.type, partial(_offers, data_path, name), latched=latched)
        watch_topic(recorder, entry, name, marks, self.get_namespace(), self._present_time, self._sample_rate)
        receive = recorder.latched_receiver(name) if latched else recorder.receiver(name)
        self._subscriptions_by_topic[name] = data_path.collect(placed, receive)

    # Marks.

    def _present_time(self) -> int:
        return present_time(self.get_clock().now().nanoseconds, self._present_recorder().last_stamp)

    def _mark_loss(self, count: int) -> None:
        if self._marks is not None:
            text = f'{count} messages not recorded: the disk was slower than the data'
            self._marks.mark(MarkKind.RECORDING_LOSS, self._present_time(), text)

    def _publish(self, mark: Mark) -> None:
        self._send_event(serialised(String(data=mark_text(mark))))

    def _publish_automatic(self, data_path: Collector, mark: Mark) -> None:
        """Publish a mark unless another recorder of this namespace does: of several the first by name."""
        try:
            infos = data_path.node.get_publishers_info_by_topic(EVENT.name)
            names = [info.node_name for info in infos if info.node_name.startswith(_FAMILY)]
            if min(names, default=data_path.node.get_name()) >= data_path.node.get_name():
                self._publish(mark)
                self._marked.append(f'{mark.kind}, {mark.text}')
        except RuntimeError:  # rclpy's errors of a context that is already shut down
            return

    def _present_sink(self) -> BagWriter | Snapshot:
        if self._sink is None:
            raise RecordingError('the recorder is not configured')
        return self._sink

    def _present_recorder(self) -> Recorder:
        if self._recorder is None:
            raise RecordingError('the recorder is not configured')
        return self._recorder


def main() -> None:
    """Run the recorder until SIGINT or SIGTERM."""
    run_node(MountRecorder)


def _sink(
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
