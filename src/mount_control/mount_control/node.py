"""ROS 2 node of the controller: a displacement message arrives, a setpoint leaves."""

import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor

from mount_control.activation import LOOK_PERIOD, Activation, AirGap, check_rate
from mount_control.control_loop import OFF, ControlLoop, SampleCounts
from mount_control.controller import load_compiled_law
from mount_control.diagnosis import counted_since, verdict
from mount_control.force_maker import ForceTableError
from mount_control.policy.contract import trace_fields
from mount_control.settings import (
    FRICTION,
    check_policies,
    control_settings,
    parameter_sets,
    run_time_parameters,
)
from mount_control.shadow import Shadow
from mount_models.arithmetic.compiled import log_compilation
from mount_models.specimen import chosen_specimen
from mount_ros import topics
from mount_ros.messages.cdr import string_message
from mount_ros.messages.event import change_text, dated
from mount_ros.messages.force_table import from_bytes, law_table_message
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import Change, SpecimenValues, declare
from mount_ros.nodes.process import run_node

_MEASURED_BEFORE = (
    'measured_before',
    False,
    ParameterDescriptor(
        description='for a supervisor that starts this node again: the measurements have come without a '
        'break since before the present table was made, so that it holds'
    ),
)
_LOADING = 5.0  # s, chosen: at 1 kHz electronics load the longest table, 1000 points, in 1 s


class MountControl(SafeLifecycleNode):
    """Answers each displacement sample with a current setpoint, while active."""

    run_time_parameters = run_time_parameters()

    def __init__(self, **arguments):
        super().__init__('mount_control', **arguments)
        for prefix, parameters in parameter_sets():
            declare(self, parameters, prefix)
        self.declare_parameter(*_MEASURED_BEFORE)
        self._of_specimen = SpecimenValues(self)
        self.loop = ControlLoop()
        self._activation = Activation()
        self._foreign = False  # whether another node publishes what this one subscribes to
        self._waiting = b''  # the newest displacement message that came while nothing was answered
        self._last_setpoint = (0, OFF)  # stamp ns, A
        self._shadow: Shadow | None = None
        self._electronics_loaded = False  # whether the electronics hold the present table
        self._order = threading.Lock()  # no answer is made while an activation begins or ends

    def configure(self) -> None:
        values = self._values()
        self._specimen = chosen_specimen(values['parameters_file'], values['specimen'])
        for prefix, parameters in FRICTION.items():
            self._of_specimen.give(parameters, prefix, self._specimen.friction)
        self._settings = control_settings(self._values(), self._specimen)
        self._foreign = False
        self._displacement = ScalarsLayout(topics.DISPLACEMENT)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._speed = ScalarsLayout(topics.ENGINE_SPEED)
        self.trace_topic = topics.control_trace(trace_fields(self._settings.policy))
        self._trace = ScalarsLayout(self.trace_topic)
        self._gap_layout = ScalarsLayout(topics.AIR_GAP)
        with log_compilation(self.get_logger().info):
            load_compiled_law(self._settings)
        self.loop.measured_before = bool(self.get_parameter(_MEASURED_BEFORE[0]).value)
        path = self.open_data_path()
        self._send_setpoint = path.sender(topics.CURRENT_SETPOINT)
        self._send_trace = path.sender(topics.CONTROL_TRACE)
        self._send_event = path.sender(topics.EVENT)
        path.subscribe(topics.DISPLACEMENT, self._on_displacement, directly=True)
        if self._settings.parameters.shadow:
            self._send_law_table = path.sender(topics.ELECTRONICS_TABLE)
            self._electronics = ScalarsLayout(topics.ELECTRONICS_SETPOINT)
            path.subscribe(topics.ELECTRONICS_SETPOINT, self._on_electronics_setpoint)
        else:  # electronics do not know the speed of the engine, so their law goes without
            path.subscribe(topics.ENGINE_SPEED, self._on_engine_speed, on_conflict=self._on_speed_conflict)
        path.subscribe(topics.AIR_GAP, self._on_air_gap)
        path.subscribe(topics.CURRENT_FORCE_TABLE, self._on_table)
        path.start()

    def activate(self) -> None:
        self.data_path.publisher_watch.wait_for_sole(self.ending)
        table, air_gap = self._activation.wait(self.loop, self.ending)
        check_rate(self.loop, self._settings.parameters.sample_rate)
        currents = self._settings.table(table.current, table.normal_force, air_gap.offset_current)
        if self._settings.parameters.shadow:
            points = zip(table.current.tolist(), table.normal_force.tolist(), strict=True)
            self._load_electronics([(air_gap.offset_current, 0.0), *points])
        self._counted, self._missing = SlidingWindow(SampleCounts()), SlidingWindow(0)
        self._doubted = SlidingWindow(self.loop.engine_speed.doubted)
        self._received = time.monotonic()
        with self._order:
            waiting, self._waiting = self._waiting, b''
            self.loop.begin(self._settings, currents, air_gap.stamp)
            self._shadow = Shadow(self.loop.counts) if self._settings.parameters.shadow else None
        self.data_path.publisher_watch.report()
        if self.lockstep and waiting:
            self._on_displacement(waiting)  # the electronics wait for an answer to what came before

    def deactivate(self) -> None:
        with self._order:  # no answer may overtake the last 0 A
            self.loop.end()
            stamp, current = self._last_setpoint
            if current != OFF:
                self._last_setpoint = stamp, OFF
                self._send_setpoint(self._setpoint.pack(stamp, (OFF,)))
            self._shadow = None
        if self._settings.parameters.shadow:
            self._send_law_table(law_table_message([]))

    def cleanup(self) -> None:
        self.loop, self._activation, self._waiting = ControlLoop(), Activation(), b''

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        self._foreign = bool(confirmed)
        if confirmed:
            self._activation = Activation()  # the table may be another node's
        self.loop.on_publisher_conflict(confirmed, suspected)

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        control_settings(values, self._specimen)
        check_policies(values)  # what has no effect now stands in event and session all the same

    def apply_changes(self, changes: Mapping[str, Change]) -> None:
        self._settings = control_settings(self._values(), self._specimen)
        text = change_text(self.get_name(), changes)
        if self.loop.controller is not None:
            self.loop.change(self._settings, text)
        else:
            self._send_change(self.loop.last or self.get_clock().now().nanoseconds, text)

    def judge(self) -> Verdict:
        loop, now = self.loop, time.monotonic()
        counts = replace(loop.counts)
        figures = {
            'policy': self._settings.parameters.policy,
            'damper': self.get_parameter('damper').value,
            'fatal': bool(loop.foreign) and self.lockstep,  # then a supervisor ends the graph
        }
        doubted = loop.engine_speed.doubted
        shadow = self._shadow
        missing = shadow.missing if shadow else 0
        return verdict(
            loop,
            counted_since(self._counted.earlier(now, counts), counts),
            doubted - self._doubted.earlier(now, doubted),
            0.0 if self.lockstep else now - self._received,
            self._settings.parameters.longest_bridge,
            figures,
            shadow,
            missing - self._missing.earlier(now, missing),
        )

    def _on_displacement(self, raw: bytes) -> None:
        stamp, (displacement,), _ = self._displacement.unpack(raw)
        with self._order:
            loop = self.loop
            current = loop.step(stamp, displacement)
            if current is not None:
                self._last_setpoint = stamp, current
                self._send_setpoint(self._setpoint.pack(stamp, (current,)))
            elif loop.controller is None:
                self._waiting = raw
            if loop.trace is not None:
                self._send_trace(self._trace.pack_record(stamp, loop.trace.tobytes()))
                if self._shadow is not None:
                    self._shadow.take(stamp, loop.current, own=True)
            while loop.changes_made:
                self._send_change(stamp, loop.changes_made.popleft())
        self._received = time.monotonic()

    def _on_engine_speed(self, raw: bytes) -> None:
        stamp, _, (velocity,) = self._speed.unpack(raw)
        with self._order:  # a displacement may come from another thread
            self.loop.engine_speed.take(stamp, velocity, self.loop.last)

    def _on_speed_conflict(self, confirmed: str, suspected: str) -> None:
        self.loop.engine_speed.conflict = confirmed or suspected

    def _load_electronics(self, points: list[tuple[float, float]]) -> None:
        """Return when the electronics hold the table of `points` (A, N); else raise `ForceTableError`."""
        self._electronics_loaded = False
        self._send_law_table(law_table_message(points))
        limit = time.monotonic() + _LOADING
        while not self._electronics_loaded:
            if time.monotonic() > limit or self.ending.wait(LOOK_PERIOD):
                raise ForceTableError(
                    f'the electronics have not loaded the table of their law within {_LOADING:g} s: set '
                    'mount_driver.shadow as mount_control.shadow; do they send MountOwnSetpoint?'
                )

    def _on_electronics_setpoint(self, raw: bytes) -> None:
        stamp, (current, loaded), _ = self._electronics.unpack(raw)
        with self._order:
            self._electronics_loaded = loaded == 1.0
            if self._shadow is not None and current == current:
                self._shadow.take(stamp, current, own=False)

    def _send_change(self, stamp: int, text: str) -> None:
        self._send_event(string_message(dated(stamp, text)))

    def _on_air_gap(self, raw: bytes) -> None:
        self._activation.air_gap = None  # whatever comes, what came before does not hold any more
        if not self._foreign:
            stamp, numbers, _ = self._gap_layout.unpack(raw)
            offset = numbers[self._gap_layout.names.index('offset_current')]
            self._activation.air_gap = AirGap(stamp, offset)

    def _on_table(self, raw: bytes) -> None:
        self._activation.table = None
        if not self._foreign:
            self._activation.table = from_bytes(raw)

    def _values(self) -> dict[str, Any]:
        return {name: self.get_parameter(name).value for name in self.get_parameters_by_prefix('')}


def main() -> None:
    """Run the node as a process."""
    run_node(MountControl)
