"""Initialisation and control as one chain of function calls: a sample goes in, a setpoint comes out.

The same cores as in the nodes, in the same order: the initialisation answers until its ramp is over, the
controller from the next sample on.
"""

from collections.abc import Mapping
from typing import Any

from mount_bringup.settings import DEFAULT_DAMPER
from mount_control.controller import Controller
from mount_control.force_to_current import resample
from mount_control.identified import check_fits, identified
from mount_control.parameters import ControlParameters, checked_parameters
from mount_control.sample_watch import Judgement, SampleWatch
from mount_init.coil_temperature import TemperatureReadings
from mount_init.initialisation import OFF, Initialisation, InitialisationResult
from mount_init.parameters import InitParameters
from mount_models.damper import DamperCurve, damper_curve
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.coefficient_check import check_friction
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_models.specimen import Specimen
from mount_models.specimen import chosen_specimen as specimen_of
from mount_sim.electronics import Reading

_PERIOD = round(SAMPLE_TIME * 1e9)  # ns

Parameters = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}, as given to the nodes."""


def control_parameters(parameters: Parameters) -> ControlParameters:
    """Return the controller's parameters of a run."""
    return checked_parameters(with_flattened(ControlParameters(), parameters.get('mount_control', {})))


def chosen_damper(parameters: Parameters) -> DamperCurve:
    """Return the damper characteristic of a run."""
    return damper_curve(parameters.get('mount_control', {}).get('damper', DEFAULT_DAMPER))


def chosen_specimen(parameters: Parameters, node: str = 'mount_init') -> Specimen:
    """Return the specimen of a run, as `node` loads it."""
    values = parameters.get(node, {})
    return specimen_of(values.get('parameters_file', ''), values.get('specimen', ''))


def friction_model(parameters: Parameters) -> tuple[FrictionCoefficients, FrictionContact]:
    """Return what the controller of a run assumes of the friction; a `ValueError` says what cannot be."""
    specimen, control = chosen_specimen(parameters, 'mount_control'), parameters.get('mount_control', {})
    check_fits(control_parameters(parameters), specimen)
    friction = identified(specimen, FrictionCoefficients(), control, 'friction')
    contact = identified(specimen, FrictionContact(), control, 'contact')
    check_friction(friction, contact)
    return friction, contact


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
        """Displacements (m) up to here are believed."""
        return self._control.displacement_range

    def expects(self, stamp: int) -> bool:
        """Whether a believable sample of time `stamp` (ns) just goes on where the last one ended."""
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
