"""Initialisation and control as one chain of function calls: a sample goes in, a setpoint comes out.

The same cores as in the nodes, in the same order: the initialisation answers until its ramp is over, the
controller from the next sample on.
"""

from mount_bringup.chosen import (
    Parameters,
    chosen_damper,
    chosen_specimen,
    control_parameters,
    friction_model,
)
from mount_control.controller import Controller
from mount_control.force_to_current import resample
from mount_control.sample_watch import Judgement, SampleWatch
from mount_init.coil_temperature import TemperatureReadings
from mount_init.initialisation import OFF, Initialisation, InitialisationResult
from mount_init.parameters import InitParameters
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.electronics.electronics import Reading

_PERIOD = round(SAMPLE_TIME * 1e9)  # ns


class CoreChain:
    """What mount_init and mount_control do with the samples of one run."""

    def __init__(self, parameters: Parameters):
        init_parameters = with_flattened(InitParameters(), parameters.get('mount_init', {}))
        self._temperatures = TemperatureReadings()
        self._initialisation = Initialisation(
            chosen_specimen(parameters), init_parameters, self._temperatures
        )
        self._control = control_parameters(parameters)
        self._damper = chosen_damper(parameters)
        self._friction, self._contact = friction_model(parameters)
        self._watch = SampleWatch(SAMPLE_TIME, self._control.longest_bridge, self._control.displacement_range)
        self.result: InitialisationResult | None = None
        self.controller: Controller | None = None
        self.controlled = False  # whether the controller answered the last sample, if only with 0 A
        self.traced = False  # whether it made a step for it, so that its trace is of this sample

    @property
    def displacement_range(self) -> float:
        """Displacements (m) up to here are plausible."""
        return self._control.displacement_range

    def expects(self, stamp: int) -> bool:
        """Whether a plausible sample of time `stamp` (ns) follows the last one without a gap."""
        return self._watch.last_stamp == stamp - _PERIOD

    def follow(self, last_stamp: int, count: int) -> None:
        """Note `count` samples that the controller answered elsewhere, the last at `last_stamp` (ns)."""
        self._watch.follow(last_stamp, count)

    def take_temperature(self, stamp: int, celsius: float) -> None:
        """Take a coil temperature (degC) of time `stamp` (ns) as it came over the bus."""
        self._temperatures.take(stamp, celsius)

    def answer(self, stamp: int, reading: Reading) -> float:
        """Return the setpoint (A) for a sample of time `stamp` (ns) as it came over the bus."""
        self.traced = False
        self.controlled = self.controller is not None
        if self.controller is not None:
            return self._control_step(self.controller, stamp, reading.displacement)
        setpoint = self._initialisation.step(
            stamp, reading.coil_current, reading.current_rate, reading.flux_rate
        )
        if self._initialisation.finished:
            self.result = self._initialisation.result()
            self.controller = self._make_controller(self.result)
        return setpoint

    def _control_step(self, controller: Controller, stamp: int, displacement: float) -> float:
        judgement, missing = self._watch.judge(stamp, displacement)
        if judgement in (Judgement.INVALID, Judgement.IGNORE):
            return OFF
        if judgement is Judgement.RESTART:
            controller.restart(displacement)
        self.traced = True
        return controller.step(displacement, missing)

    def _make_controller(self, result: InitialisationResult) -> Controller:
        table = resample(*result.table, result.offset_current, self._control.highest_current)
        return Controller(self._control, self._damper, self._friction, self._contact, table)
