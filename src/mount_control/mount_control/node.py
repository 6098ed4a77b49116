"""ROS 2 node of the controller: a displacement message arrives, a setpoint leaves."""

import contextlib
import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.parameter import Parameter
from std_msgs.msg import String

from mount_control.activation import Activation, AirGap
from mount_control.answering import OFF, Answering
from mount_control.controller import load_compiled_law
from mount_control.damping_log import DampingLog
from mount_control.diagnosis import ControlFigures, Counted, Unread, counted, verdict
from mount_control.policy.contract import trace_fields
from mount_control.sample_watch import Judgement
from mount_control.settings import (
    FRICTION,
    check_policies,
    control_settings,
    defaults,
    parameter_sets,
    run_time_parameters,
    without_effect,
)
from mount_models.arithmetic.compiled import compilation_told
from mount_models.damper import DamperError, damper_text
from mount_models.specimen import chosen_specimen
from mount_ros import topics
from mount_ros.messages.cdr import serialised
from mount_ros.messages.event import change_text, dated
from mount_ros.messages.force_table import ForceTableMessageError, from_bytes
from mount_ros.messages.scalars import ScalarsError, ScalarsLayout
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import Change, SpecimenValues, declare
from mount_ros.nodes.process import run_node
from mount_ros.publishers import UnnamedPublisher
from mount_ros.timing import LatencyHistogram

_MEASURED_BEFORE = (
    'measured_before',
    False,
    ParameterDescriptor(
        description='for a supervisor that starts this node again: the measurements have come without a '
        'break since before the present table was made, so that it holds'
    ),
)


class MountControl(SafeLifecycleNode):
    """Answers each displacement sample with a current setpoint, while active."""

    run_time_parameters = run_time_parameters()

    def __init__(self, **arguments):
        super().__init__('mount_control', **arguments)
        for prefix, parameters in parameter_sets():
            declare(self, parameters, prefix)
        self.declare_parameter(*_MEASURED_BEFORE)
        self.add_pre_set_parameters_callback(_spelled_out)
        self._of_specimen = SpecimenValues(self)
        self.answering = Answering()
        self._activation = Activation()
        self._damping_log = DampingLog()
        self._foreign = False  # whether another node publishes what this one hears
        self._nameless = UnnamedPublisher()
        self._unread = Unread()
        self._last_sample: tuple[int, float] | None = None  # stamp ns, m
        self._last_setpoint = (0, OFF)  # stamp ns, A
        self._order = threading.Lock()  # in lock-step the first answer may come from the activation's thread

    def configure(self) -> None:
        values = self._values()
        self._specimen = chosen_specimen(values['parameters_file'], values['specimen'])
        for prefix, parameters in FRICTION.items():
            self._of_specimen.give(parameters, prefix, self._specimen.friction)
        self.set_parameters([self.get_parameter('damper')])  # with the points of a file, see _spelled_out
        self._settings = control_settings(self._values(), self._specimen)
        usual = defaults()
        self._warn_without_effect(name for name, value in self._values().items() if value != usual.get(name))
        self._parameter_changes = 0
        self._foreign, self._unread = False, Unread()
        self._displacement = ScalarsLayout(topics.DISPLACEMENT)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self.trace_topic = topics.control_trace(trace_fields(self._settings.policy))
        self._trace = ScalarsLayout(self.trace_topic)
        self._gap_layout = ScalarsLayout(topics.AIR_GAP)
        with compilation_told(self.get_logger().info):
            load_compiled_law(self._settings)
        self.answering.watch.measured_before = bool(self.get_parameter(_MEASURED_BEFORE[0]).value)
        path = self.open_data_path()
        self._send_setpoint = path.sender(topics.CURRENT_SETPOINT)
        self._send_trace = path.sender(topics.CONTROL_TRACE)
        self._send_event = path.sender(topics.EVENT)
        path.subscribe(topics.DISPLACEMENT, self._on_displacement, directly=True)
        path.subscribe(topics.AIR_GAP, self._on_air_gap)
        path.subscribe(topics.CURRENT_FORCE_TABLE, self._on_table)
        path.start()

    def activate(self) -> None:
        self.wait_for_sole_publishers()
        table, air_gap = self._activation.wait(self.answering.watch, self.ending)
        self.answering.watch.check_rate(self._settings.parameters.sample_rate)
        currents = self._settings.table(table.current, table.normal_force, air_gap.offset_current)
        self._latency = LatencyHistogram()
        self._counted = SlidingWindow(Counted())
        self._heard = time.monotonic()
        self._damping_log = DampingLog()
        self.answering.begin(self._settings, currents, air_gap.stamp)
        self.report_publisher_conflict()
        self.get_logger().info(
            f'takes the table of {air_gap.stamp * 1e-9:.3f} s: up to {max(table.normal_force):.0f} N, offset '
            f'current {air_gap.offset_current:.3f} A; policy {self._settings.parameters.policy}'
        )
        if self.lockstep and self._last_sample is not None:
            self._answer(*self._last_sample)  # the electronics wait for an answer to what came before

    def deactivate(self) -> None:
        with self._order:  # no answer may overtake the last 0 A
            self.answering.end()
            if self._last_setpoint[1] != OFF:
                self._publish_setpoint(self._last_setpoint[0], OFF)

    def cleanup(self) -> None:
        self.answering, self._activation, self._last_sample = Answering(), Activation(), None

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        self._foreign = bool(confirmed)
        if confirmed:
            self._activation = Activation()  # the table may be another node's
        self.answering.on_publisher_conflict(confirmed, suspected)

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        control_settings(values, self._specimen)
        check_policies(values)  # what has no effect now stands in event and session all the same

    def apply_changes(self, changes: Mapping[str, Change]) -> None:
        self._settings = control_settings(self._values(), self._specimen)
        self._parameter_changes += len(changes)
        self._warn_without_effect(changes)
        told = ', '.join(f'{name} from {change.old} to {change.new}' for name, change in changes.items())
        self.get_logger().info(f'goes on with {told}')
        text = change_text(self.get_name(), changes)
        if self.answering.controller is not None:
            self.answering.change(self._settings, text)
        else:
            self._tell(self.answering.watch.last or self.get_clock().now().nanoseconds, text)

    def judge(self) -> Verdict:
        answering, now = self.answering, time.monotonic()
        if line := self._damping_log.look(answering.damping_active, now):
            self.get_logger().info(line)
        counts = replace(answering.watch.counts)
        earlier = self._counted.earlier(now, counted(counts, self._unread))
        return verdict(
            ControlFigures(
                counts=counts,
                earlier=earlier,
                silence=0.0 if self.lockstep else now - self._heard,
                longest_silence=self._settings.parameters.longest_bridge,
                table_refusal=answering.refusal,
                writer_doubt=answering.watch.writer_doubt,
                foreign=answering.watch.foreign,
                name_awaited=self._nameless.is_awaited(answering.watch.nameless),
                unread=self._unread,
                damping_active=answering.damping_active,
                current=answering.current,
                step_median=self._latency.quantile(0.5),
                step_p99=self._latency.quantile(0.99),
                last_stamp=answering.watch.last,
                lockstep=self.lockstep,
                faults=answering.faults,
                last_fault=answering.last_fault,
                policy=self._settings.parameters.policy,
                damper=self.get_parameter('damper').value,
                parameter_changes=self._parameter_changes,
                doubt=answering.watch.plausibility.sentence,
                doubted=answering.watch.plausibility.held,
            )
        )

    def _on_displacement(self, raw: bytes) -> None:
        begin = time.monotonic()
        try:
            stamp, (displacement,), _ = self._displacement.unpack(raw)
        except ScalarsError as error:
            self._note_unread(error)
            return
        self._last_sample = stamp, displacement
        if self._answer(stamp, displacement) is not Judgement.INACTIVE:
            self._heard = begin
            self._latency.add(time.monotonic() - begin)

    def _answer(self, stamp: int, displacement: float) -> Judgement:
        with self._order:
            answer = self.answering.answer(stamp, displacement)
            if answer.current is not None:
                self._publish_setpoint(stamp, answer.current)
            if answer.trace is not None:
                self._send_trace(self._trace.pack_record(stamp, answer.trace))
            for text in answer.told:
                self._tell(stamp, text)
        return answer.reason

    def _publish_setpoint(self, stamp: int, current: float) -> None:
        self._last_setpoint = (stamp, current)
        self._send_setpoint(self._setpoint.pack(stamp, (current,)))

    def _tell(self, stamp: int, text: str) -> None:
        self._send_event(serialised(String(data=dated(stamp, text))))

    def _on_air_gap(self, raw: bytes) -> None:
        self._activation.air_gap = None
        if self._foreign:
            return
        try:
            stamp, numbers, _ = self._gap_layout.unpack(raw)
        except ScalarsError as error:
            self._note_unread(error)
            return
        offset_current = numbers[self._gap_layout.names.index('offset_current')]
        self._activation.air_gap = AirGap(stamp, offset_current)

    def _on_table(self, raw: bytes) -> None:
        self._activation.table = None
        if self._foreign:
            return
        try:
            self._activation.table = from_bytes(raw)
        except ForceTableMessageError as error:
            self._note_unread(error)

    def _note_unread(self, error: ValueError) -> None:
        self._unread = self._unread.and_another(error)
        self.get_logger().error(str(error), throttle_duration_sec=1.0)

    def _warn_without_effect(self, names: Iterable[str]) -> None:
        if sentence := without_effect(names, self._settings.parameters.policy):
            self.get_logger().warning(sentence)

    def _values(self) -> dict[str, Any]:
        return {name: self.get_parameter(name).value for name in self.get_parameters_by_prefix('')}


def _spelled_out(parameters: list[Parameter]) -> list[Parameter]:
    """Return parameters about to be set with the points of a damper's file instead of its path.

    So it is read once, and event and session hold what it said. What cannot be read is refused afterwards.
    """
    spelled = []
    for parameter in parameters:
        if parameter.name == 'damper' and isinstance(parameter.value, str):
            with contextlib.suppress(DamperError):
                parameter = Parameter('damper', value=damper_text(parameter.value))
        spelled.append(parameter)
    return spelled


def main() -> None:
    """Run the node as a process."""
    run_node(MountControl)
