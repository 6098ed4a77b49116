"""ROS 2 node of the initialisation: at each activation one current ramp, then gaps and table, latched."""

import math
import time

from mount_init.coil_temperature import TemperatureReadings
from mount_init.diagnosis import InitFigures, verdict
from mount_init.dialogue import CoilDialogue
from mount_init.driver_report import DriverReport
from mount_init.errors import DriverRefusalError, InitialisationError
from mount_init.initialisation import Initialisation, InitialisationResult, load_compiled_laws
from mount_init.parameters import InitParameters
from mount_models.arithmetic.compiled import compilation_told
from mount_models.specimen import chosen_specimen
from mount_models.specimen_choice import SpecimenChoice
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import serialised
from mount_ros.messages.force_table import to_message
from mount_ros.messages.scalars import ScalarsError, ScalarsLayout
from mount_ros.messages.temperature import temperature_of
from mount_ros.messages.verdicts import verdicts_of
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node

_DRIVER_PATIENCE = 0.3  # s, chosen: the driver looks at itself ten times a second
_VERDICT_PERIOD = 1.2  # s, chosen: it tells its figures once a second


class MountInit(SafeLifecycleNode):
    """Measures the air gap while it is being activated; active means that a result is latched."""

    def __init__(self, **arguments):
        super().__init__('mount_init', **arguments)
        declare(self, InitParameters())
        declare(self, SpecimenChoice())
        self._dialogue: CoilDialogue | None = None
        self._result: tuple[int, InitialisationResult] | None = None

    def configure(self) -> None:
        self._init_parameters = read(self, InitParameters())
        self._specimen = chosen_specimen(
            str(self.get_parameter('parameters_file').value), str(self.get_parameter('specimen').value)
        )
        Initialisation(self._specimen, self._init_parameters)  # refuses what does not fit together
        with compilation_told(self.get_logger().info):
            load_compiled_laws(self._specimen)
        self._malformed, self._malformed_reason = 0, ''
        self._malformed_before = SlidingWindow(0)
        self._temperatures = TemperatureReadings()
        self._driver = DriverReport(self.get_namespace(), self._init_parameters.peak_current)
        self._ripple = ScalarsLayout(topics.COIL_RIPPLE)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._air_gap = ScalarsLayout(topics.AIR_GAP)
        path = self.open_data_path()
        self._send_setpoint = path.sender(topics.CURRENT_SETPOINT)
        self._send_air_gap = path.sender(topics.AIR_GAP)
        self._send_table = path.sender(topics.CURRENT_FORCE_TABLE)
        self._dialogue = CoilDialogue(self._publish_setpoint)
        path.subscribe(topics.COIL_TEMPERATURE, self._on_temperature)
        self._subscribe_streams(path)
        path.start()

    def activate(self) -> None:
        assert self._dialogue is not None
        self.real_time.begin(self)  # the ramp is part of the activation
        self._resume_streams()
        self.wait_for_sole_publishers()
        parameters = self._init_parameters
        self._dialogue.await_quiet(parameters.quiet_duration, self.ending)
        if reason := self._driver.settled(False, _DRIVER_PATIENCE, self.ending):
            raise DriverRefusalError(reason)
        ramp = Initialisation(self._specimen, parameters, self._temperatures)
        try:
            result = self._ramp(self._dialogue, ramp)
        except InitialisationError as error:
            if reason := self._driver.settled(True, _DRIVER_PATIENCE, self.ending):
                raise DriverRefusalError(reason) from error
            raise
        assert ramp.last_stamp is not None
        self._publish_result(ramp.last_stamp, result)
        self._end_streams()
        self._result = (ramp.last_stamp, result)

    def deactivate(self) -> None:
        self._result = None
        if self._dialogue is not None:
            self._dialogue.switch_off()

    def cleanup(self) -> None:
        self.deactivate()

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        if self._dialogue is not None and (confirmed or suspected):
            self._dialogue.give_way(confirmed or suspected)

    def judge(self) -> Verdict:
        assert self._result is not None
        stamp, result = self._result
        malformed = self._malformed
        lately = malformed - self._malformed_before.earlier(time.monotonic(), malformed)
        figures = InitFigures(result, stamp, malformed, self._malformed_reason, lately)
        return verdict(figures, self._specimen, self._init_parameters)

    def _ramp(self, dialogue: CoilDialogue, ramp: Initialisation) -> InitialisationResult:
        parameters = self._init_parameters
        # in lock-step only silence can tell a stalled chain from a slow machine
        total_timeout = math.inf if self.lockstep else parameters.total_timeout
        before = self._driver.late_setpoints or 0
        dialogue.run(ramp, parameters.silence_timeout, total_timeout, self.ending, self._objection)
        if ramp.disturbed:
            self._driver.hear(_VERDICT_PERIOD, self.ending)
            late = self._driver.late_setpoints
            if late is not None:
                ramp.note_late(late - before if late >= before else late)
        return ramp.result()

    def _objection(self) -> str:
        assert isinstance(self.data_path, DataPath)
        self.data_path.publisher_watch.look()  # a thread that polls the messages does not hear who comes
        return self._driver.refusal

    # With the result latched no sample is answered, so the streams are unsubscribed: that saves CPU time.

    def _subscribe_streams(self, path: DataPath) -> None:
        path.subscribe(topics.COIL_RIPPLE, self._on_ripple)
        path.subscribe(topics.CURRENT_SETPOINT, self._on_setpoint)
        path.subscribe(topics.DIAGNOSTICS, self._on_verdicts)
        self._unsubscribed = False

    def _resume_streams(self) -> None:
        assert self._dialogue is not None
        assert isinstance(self.data_path, DataPath)
        if self._unsubscribed:
            self._dialogue.forget_streams()
            self._subscribe_streams(self.data_path)

    def _end_streams(self) -> None:
        assert isinstance(self.data_path, DataPath)
        if self.lockstep:
            return  # the sample that waits for the next ramp must not be missed
        self.data_path.unsubscribe(topics.COIL_RIPPLE)
        self.data_path.unsubscribe(topics.CURRENT_SETPOINT)
        self.data_path.unsubscribe(topics.DIAGNOSTICS)
        self._unsubscribed = True

    def _publish_setpoint(self, stamp: int, current: float) -> None:
        self._send_setpoint(self._setpoint.pack(stamp, (current,)))

    def _publish_result(self, stamp: int, result: InitialisationResult) -> None:
        numbers = [getattr(result, name) for name in self._air_gap.names]
        table = to_message(stamp, result.table)
        self._send_air_gap(self._air_gap.pack(stamp, numbers))
        self._send_table(serialised(table))
        self.get_logger().info(
            f'rest gap {result.rest_gap * 1e6:.1f} um, contact gap {result.contact_gap * 1e6:.1f} um, '
            f'offset current {result.offset_current:.3f} A'
        )

    def _on_ripple(self, raw: bytes) -> None:
        try:
            stamp, (current, _), (current_rate, flux_rate) = self._ripple.unpack(raw)
        except ScalarsError as error:
            self._note_malformed(error)
            return
        if self._dialogue is not None:
            self._dialogue.take_ripple(stamp, current, current_rate, flux_rate)

    def _on_temperature(self, raw: bytes) -> None:
        self._temperatures.take(*temperature_of(raw))

    def _on_verdicts(self, raw: bytes) -> None:
        for told in verdicts_of(raw):
            self._driver.take(told.node, told.sentence, told.figures)

    def _on_setpoint(self, raw: bytes) -> None:
        try:
            stamp, (current,), _ = self._setpoint.unpack(raw)
        except ScalarsError as error:
            self._note_malformed(error)
            return
        if self._dialogue is not None:
            self._dialogue.take_setpoint(stamp, current)

    def _note_malformed(self, error: ScalarsError) -> None:
        self._malformed += 1
        self._malformed_reason = str(error)


def main() -> None:
    """Run the node until the process is told to end."""
    run_node(MountInit)
