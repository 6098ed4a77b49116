"""ROS 2 node of the controller: a displacement message arrives, a setpoint leaves."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from rclpy.parameter import Parameter
from std_msgs.msg import String

from mount_control.activation import MeasurementStream, check_belongs
from mount_control.controller import TRACE, ControlLaw, Controller, load_compiled_law
from mount_control.diagnosis import ControlFigures, verdict
from mount_control.force_to_current import ForceTableError, resample
from mount_control.identified import check_fits
from mount_control.parameters import DEFAULT_DAMPER, RUN_TIME, ControlParameters, checked_parameters
from mount_control.sample_watch import Judgement, SampleWatch
from mount_models.damper import DamperError, damper_curve, damper_text
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_models.specimen import chosen_specimen
from mount_ros import topics
from mount_ros.messages.cdr import serialised
from mount_ros.messages.event import change_text, dated
from mount_ros.messages.force_table import ForceTable, ForceTableMessageError, from_bytes
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.nodes.diagnostics import Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameter_gate import Change
from mount_ros.nodes.parameters import SpecimenValues, declare, read
from mount_ros.nodes.process import run_node
from mount_ros.timing import LatencyHistogram

_OFF = 0.0  # A
_TABLE_PATIENCE = 1.0  # s, chosen: latched messages may still be under way when control is activated


class MountControl(SafeLifecycleNode):
    """Answers each displacement sample with a current setpoint, while active."""

    run_time_parameters = RUN_TIME

    def __init__(self, **arguments):
        super().__init__('mount_control', **arguments)
        declare(self, ControlParameters())
        declare(self, FrictionCoefficients(), 'friction')
        declare(self, FrictionContact(), 'contact')
        self.declare_parameter('damper', DEFAULT_DAMPER)
        self.declare_parameter('parameters_file', '')
        self.declare_parameter('specimen', '')
        self.add_pre_set_parameters_callback(_spelled_out)
        self._of_specimen = SpecimenValues(self)
        self._controller: Controller | None = None
        self._table: ForceTable | None = None
        self._air_gap: tuple[int, tuple[float, ...]] | None = None
        self._stream = MeasurementStream()
        self._last_message: bytes | None = None
        self._table_refusal = ''
        self._parameter_changes = 0  # since it was configured
        self._faults, self._last_fault = 0, 0  # of the controller, and the stamp (ns) of the last
        self._last_setpoint = (0, _OFF)  # stamp ns, A
        self._answering = threading.Lock()
        self._laws: deque[tuple[ControlLaw, str]] = deque()  # for the next sample, and what is told of them

    def configure(self) -> None:
        self._settings = checked_parameters(read(self, ControlParameters()))
        specimen = chosen_specimen(
            str(self.get_parameter('parameters_file').value), str(self.get_parameter('specimen').value)
        )
        check_fits(self._settings, specimen)
        self._of_specimen.give(FrictionCoefficients(), 'friction', specimen.friction)
        self._of_specimen.give(FrictionContact(), 'contact', specimen.friction)
        self._friction = read(self, FrictionCoefficients(), 'friction')
        self._contact = read(self, FrictionContact(), 'contact')
        self.set_parameters([self.get_parameter('damper')])  # with the points of a file, see _spelled_out
        self._damper = damper_curve(self.get_parameter('damper').value)
        self._parameter_changes = 0
        self._displacement = ScalarsLayout(topics.DISPLACEMENT)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._trace = ScalarsLayout(topics.CONTROL_TRACE)
        self._gap_layout = ScalarsLayout(topics.AIR_GAP)
        if self._trace.names != TRACE.names:
            raise ValueError('control_trace in the topic registry differs from what the controller traces')
        load_compiled_law(self._settings, self._damper, self._friction, self._contact)
        path = self.open_data_path()
        self._send_setpoint = path.sender(topics.CURRENT_SETPOINT)
        self._send_trace = path.sender(topics.CONTROL_TRACE)
        self._send_event = path.sender(topics.EVENT)
        path.subscribe(topics.DISPLACEMENT, self._on_displacement)
        path.subscribe(topics.AIR_GAP, self._on_air_gap)
        path.subscribe(topics.CURRENT_FORCE_TABLE, self._on_table)
        path.start()

    def activate(self) -> None:
        table, gap_stamp, offset_current = self._wait_for_table()
        self._currents = resample(
            table.current, table.normal_force, offset_current, self._settings.highest_current
        )
        controller = Controller(self._settings, self._damper, self._friction, self._contact, self._currents)
        self._watch = SampleWatch(
            SAMPLE_TIME, self._settings.longest_bridge, self._settings.displacement_range
        )
        self._latency = LatencyHistogram()
        self._activation = gap_stamp
        self._table_refusal = ''
        self._faults, self._last_fault = 0, 0
        self._laws.clear()
        self._heard = time.monotonic()
        self._controller = controller  # from here on samples are answered
        if self.lockstep and self._last_message is not None:
            self._answer_waiting_sample()

    def deactivate(self) -> None:
        with self._answering:  # no answer may overtake the last 0 A
            self._controller = None
            if self._last_setpoint[1] != _OFF:
                self._publish_setpoint(self._last_setpoint[0], _OFF)

    def cleanup(self) -> None:
        self._table, self._air_gap = None, None
        self._stream = MeasurementStream()
        self._last_message = None

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        checked_parameters(with_flattened(ControlParameters(), values))
        damper_curve(values['damper'])

    def take_changes(self, changes: Mapping[str, Change]) -> None:
        self._settings = checked_parameters(read(self, ControlParameters()))
        self._damper = damper_curve(self.get_parameter('damper').value)
        self._parameter_changes += len(changes)
        text = change_text(self.get_name(), changes)
        if self._controller is None:
            self._tell(self._stream.last or self.get_clock().now().nanoseconds, text)
            return
        law = ControlLaw(self._settings, self._damper, self._friction, self._contact, self._currents)
        self._laws.append((law, text))  # taken in the thread of the data, at the next sample

    def judge(self) -> Verdict:
        trace = self._controller.trace if self._controller else None
        return verdict(
            ControlFigures(
                counts=self._watch.counts,
                silence=0.0 if self.lockstep else time.monotonic() - self._heard,
                longest_silence=self._settings.longest_bridge,
                table_refusal=self._table_refusal,
                damping_active=bool(trace is not None and trace['damping_active']),
                current=float(trace['current']) if trace is not None else _OFF,
                step_median=self._latency.quantile(0.5),
                step_p99=self._latency.quantile(0.99),
                last_stamp=self._stream.last,
                faults=self._faults,
                last_fault=self._last_fault,
                damper=self.get_parameter('damper').value,
                parameter_changes=self._parameter_changes,
            )
        )

    def _wait_for_table(self) -> tuple[ForceTable, int, float]:
        """Return table, stamp and offset current (A) of this activation; they may still be under way."""
        limit = time.monotonic() + _TABLE_PATIENCE
        while True:
            table, air_gap = self._table, self._air_gap
            try:
                check_belongs(table.stamp if table else None, air_gap[0] if air_gap else None, self._stream)
            except ForceTableError:
                if time.monotonic() > limit or self.ending.wait(0.01):
                    raise
                continue
            assert table is not None
            assert air_gap is not None
            offset_current = air_gap[1][self._gap_layout.names.index('offset_current')]
            return table, air_gap[0], offset_current

    def _on_displacement(self, raw: bytes) -> None:
        begin = time.monotonic()
        self._last_message = raw
        stamp, (displacement,), _ = self._displacement.unpack(raw)
        self._stream.note(stamp)
        if self._controller is not None:
            self._answer(stamp, displacement)
            self._heard = begin
            self._latency.add(time.monotonic() - begin)

    def _answer(self, stamp: int, displacement: float) -> None:
        with self._answering:  # in lock-step the first answer may come from the activation's thread
            self._answer_once(stamp, displacement)

    def _answer_once(self, stamp: int, displacement: float) -> None:
        controller = self._controller
        if controller is None:
            return
        if self._table_is_outdated():
            self._publish_setpoint(stamp, _OFF)
            return
        if stamp <= self._activation:
            return
        judgement, missing = self._watch.judge(stamp, displacement)
        if judgement is Judgement.IGNORE:
            return
        if judgement is Judgement.INVALID:
            self._publish_setpoint(stamp, _OFF)
            return
        told = self._take_laws(controller) if self._laws else ()
        if judgement is Judgement.RESTART:
            controller.restart(displacement)
        self._publish_setpoint(stamp, controller.step(displacement, missing))
        if controller.faults != self._faults:
            self._faults, self._last_fault = controller.faults, stamp
        self._send_trace(self._trace.pack_record(stamp, controller.trace_bytes))
        for text in told:
            self._tell(stamp, text)

    def _take_laws(self, controller: Controller) -> list[str]:
        """Go on with the newest law from this sample on; return what is to be told."""
        told = []
        while self._laws:
            law, text = self._laws.popleft()
            controller.change(law)
            told.append(text)
        return told

    def _tell(self, stamp: int, text: str) -> None:
        self._send_event(serialised(String(data=dated(stamp, text))))

    def _table_is_outdated(self) -> bool:
        if not self._table_refusal and not self._stream.holds(self._activation):
            self._table_refusal = (
                'the measurements were interrupted for more than 1 s since the table was made, or their time '
                'went back; deactivate mount_control and activate mount_init again'
            )
        return bool(self._table_refusal)

    def _answer_waiting_sample(self) -> None:
        """In lock-step the electronics wait for an answer to the sample that came before activation."""
        raw = self._last_message
        stamp, (displacement,), _ = self._displacement.unpack(raw)
        self._answer(stamp, displacement)

    def _publish_setpoint(self, stamp: int, current: float) -> None:
        self._last_setpoint = (stamp, current)
        self._send_setpoint(self._setpoint.pack(stamp, (current,)))

    def _on_air_gap(self, raw: bytes) -> None:
        stamp, values, _ = self._gap_layout.unpack(raw)
        self._air_gap = (stamp, values)

    def _on_table(self, raw: bytes) -> None:
        try:
            self._table = from_bytes(raw)
        except ForceTableMessageError as error:
            self._table = None
            self.get_logger().error(str(error))


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
