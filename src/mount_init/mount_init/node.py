"""ROS 2 node of the initialisation: at each activation one current ramp, then gaps and table, latched."""

import math
from dataclasses import replace

from mount_init.checks import WEAR_RESERVE, wear_reserve
from mount_init.dialogue import CoilDialogue, DriverReport
from mount_init.errors import InitialisationError
from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import Initialisation, InitialisationResult, load_compiled_laws
from mount_init.parameters import InitParameters
from mount_models.arithmetic.compiled import log_compilation
from mount_models.specimen import Specimen, chosen_specimen
from mount_models.specimen_choice import SpecimenChoice
from mount_ros import topics
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import ScalarsLayout, temperature_of
from mount_ros.messages.verdicts import Level, flags_of, verdicts_of
from mount_ros.nodes.diagnostics import Finding, Verdict, verdict_on
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node

_GAPS = ('rest_gap', 'contact_gap', 'rest_gap_std', 'contact_gap_std')


class MountInit(SafeLifecycleNode):
    """Measures the air gap while it is being activated; active means that a result is latched."""

    def __init__(self, **arguments):
        super().__init__('mount_init', **arguments)
        declare(self, InitParameters())
        declare(self, SpecimenChoice())
        self._dialogue = CoilDialogue(self._publish_setpoint)
        self._result: tuple[int, InitialisationResult] | None = None
        self._unsubscribed = False

    def configure(self) -> None:
        self._init_parameters = read(self, InitParameters())
        self._specimen = chosen_specimen(
            str(self.get_parameter('parameters_file').value), str(self.get_parameter('specimen').value)
        )
        Initialisation(self._specimen, self._init_parameters)  # refuses what does not fit together
        with log_compilation(self.get_logger().info):
            load_compiled_laws(self._specimen)
        self._temperatures = TemperatureReadings()
        self._driver = DriverReport(self._init_parameters.peak_current)
        self._driver_name = f'{self.get_namespace().strip("/")}/mount_driver'.lstrip('/')
        self._ripple = ScalarsLayout(topics.COIL_RIPPLE)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._air_gap = ScalarsLayout(topics.AIR_GAP)
        self._path = path = self.open_data_path()
        self._send_setpoint = path.sender(topics.CURRENT_SETPOINT)
        self._send_air_gap = path.sender(topics.AIR_GAP)
        self._send_table = path.sender(topics.CURRENT_FORCE_TABLE)
        self._dialogue = CoilDialogue(self._publish_setpoint)
        path.subscribe(topics.COIL_TEMPERATURE, self._on_temperature)
        self._subscribe_streams()
        path.start()

    def activate(self) -> None:
        self.real_time.begin(self)  # the ramp is part of the activation
        if self._unsubscribed:
            self._dialogue.forget_streams()
            self._subscribe_streams()
        self.data_path.publisher_watch.wait_for_sole(self.ending)
        self._dialogue.await_quiet(self._init_parameters.quiet_duration, self.ending)
        parameters = self._init_parameters
        if self.lockstep:  # only silence can tell a stalled chain from a slow machine
            parameters = parameters._replace(total_timeout=math.inf)
        ramp = Initialisation(self._specimen, parameters, self._temperatures)
        try:
            # The diagnostics pause meanwhile, so it is looked for other writers here.
            self._dialogue.run(ramp, self.ending, self._path.publisher_watch.check)
            result = ramp.result()
        except InitialisationError as error:
            raise InitialisationError(self._driver.refusal(self.ending) or str(error)) from error
        stamp = ramp.stamps[-1]
        numbers = [getattr(result, name) for name in self._air_gap.names]
        self._send_air_gap(self._air_gap.pack(stamp, numbers))
        self._send_table(table_message(stamp, result.table))
        self.get_logger().info(_summary(result))
        if not self.lockstep:  # there the sample that waits for the next ramp must not be missed
            # No sample is answered any more: without subscriptions there is less to do.
            for topic in (topics.COIL_RIPPLE, topics.CURRENT_SETPOINT, topics.DIAGNOSTICS):
                self._path.unsubscribe(topic)
            self._unsubscribed = True
        self._result = stamp, result

    def deactivate(self) -> None:
        self._result = None
        self._dialogue.switch_off()

    def cleanup(self) -> None:
        self.deactivate()

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        if confirmed or suspected:
            self._dialogue.give_way(confirmed or suspected)

    def judge(self) -> Verdict:
        assert self._result is not None
        stamp, result = self._result
        found = verdict(result, self._specimen)
        return replace(found, figures={**found.figures, 'last_stamp': stamp})

    def _subscribe_streams(self) -> None:
        self._path.subscribe(topics.COIL_RIPPLE, self._on_ripple)
        self._path.subscribe(topics.CURRENT_SETPOINT, self._on_setpoint)
        self._path.subscribe(topics.DIAGNOSTICS, self._on_verdicts)
        self._unsubscribed = False

    def _publish_setpoint(self, stamp: int, current: float) -> None:
        self._send_setpoint(self._setpoint.pack(stamp, (current,)))

    def _on_ripple(self, raw: bytes) -> None:
        stamp, (current, _), rates = self._ripple.unpack(raw)
        self._dialogue.take_ripple(stamp, current, *rates)

    def _on_temperature(self, raw: bytes) -> None:
        self._temperatures.take(*temperature_of(raw))

    def _on_verdicts(self, raw: bytes) -> None:
        for report in verdicts_of(raw):
            if report.node == self._driver_name:
                flags = flags_of(report.figures)
                self._driver.take(flags.switched_off or flags.held, report.sentence, report.figures)

    def _on_setpoint(self, raw: bytes) -> None:
        stamp, (current,), _ = self._setpoint.unpack(raw)
        self._dialogue.take_setpoint(stamp, current)


def verdict(result: InitialisationResult, specimen: Specimen) -> Verdict:
    """Return the verdict on a latched result; a pure function."""
    evidence, supply = result.evidence, result.evidence.supply
    figures = {
        **{f'{name}_um': f'{getattr(result, name) * 1e6:.2f}' for name in _GAPS},
        'contact_force_N': f'{result.contact_force:.2f}',
        'offset_current_A': f'{result.offset_current:.4f}',
        'highest_normal_force_N': f'{result.table[1, -1]:.1f}',
        'coil_temperature_celsius': f'{evidence.temperature.celsius:.1f}',
        'coil_temperature_from': evidence.temperature.source,
        'resistance_ohm': f'{supply.whole.ohm:.3f}',
        'link_voltage_V': f'{supply.whole.link_voltage:.2f}',
        'wear_reserve_um': f'{_reserve(result, specimen) * 1e6:.1f}',
        'samples_used': evidence.samples,
        'samples_invalid': evidence.skipped,
    }
    warning = _warning(result, specimen)
    findings = [Finding(Level.WARN, 'result', warning)] if warning else []
    return verdict_on(findings, _summary(result), figures)


def _reserve(result: InitialisationResult, specimen: Specimen) -> float:
    return wear_reserve(result.contact_gap, result.table[1, -1], specimen)


def _warning(result: InitialisationResult, specimen: Specimen) -> str:
    """Return what a result that holds is warned of, empty where it is nothing."""
    reserve = _reserve(result, specimen)
    if reserve < WEAR_RESERVE:
        return (
            f'pads are nearly worn: {reserve * 1e6:.1f} um until the gap leaves the calibrated range, less '
            f'than {WEAR_RESERVE * 1e6:.0f} um; replace the pads'
        )
    if specimen.temperature is not None and math.isnan(result.evidence.temperature.celsius):
        return (
            f'{_summary(result)}; not compensated for the coil temperature, which is unknown: right at '
            f'{specimen.temperature.calibration_celsius:.0f} degC only; do the electronics report it '
            '(topic coil_temperature)? Else set coil_temperature_celsius'
        )
    return ''


def _summary(result: InitialisationResult) -> str:
    return (
        f'rest gap {result.rest_gap * 1e6:.1f} um, contact gap {result.contact_gap * 1e6:.1f} um, '
        f'offset current {result.offset_current:.3f} A'
    )


def main() -> None:
    """Run the node until the process is told to end."""
    run_node(MountInit)
