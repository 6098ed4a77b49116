"""Initialisation and control as one chain of function calls: a sample goes in, a setpoint comes out.

The same cores as in the nodes, in the same order: the initialisation answers until its ramp is over, the
controller from the next sample on.
"""

from engine_mount.settings.chosen import Parameters, chosen_control, chosen_specimen
from mount_control.control_loop import OFF, ControlLoop
from mount_control.policy.contract import Policy
from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import Initialisation, InitialisationResult
from mount_init.parameters import InitParameters
from mount_models.quantity import with_flattened
from mount_sim.electronics.electronics import Reading


class CoreChain:
    """What mount_init and mount_control do with the samples of one run."""

    def __init__(self, parameters: Parameters):
        init_parameters = with_flattened(InitParameters(), parameters.get('mount_init', {}))
        self._temperatures = TemperatureReadings()
        self._initialisation = Initialisation(
            chosen_specimen(parameters), init_parameters, self._temperatures
        )
        self._control = chosen_control(parameters)
        self.loop = ControlLoop()
        self.result: InitialisationResult | None = None
        self.controlled = False  # whether the controller answered the last sample, if only with 0 A

    @property
    def displacement_range(self) -> float:
        """Displacements (m) up to here are plausible."""
        return self._control.parameters.displacement_range

    @property
    def policy(self) -> Policy:
        """The policy of the controller."""
        return self._control.policy

    def take_temperature(self, stamp: int, celsius: float) -> None:
        """Take a coil temperature (degC) of time `stamp` (ns) as it came over the bus."""
        self._temperatures.take(stamp, celsius)

    def answer(self, stamp: int, reading: Reading) -> float:
        """Return the setpoint (A) for a sample of time `stamp` (ns) as it came over the bus."""
        self.controlled = self.loop.controller is not None
        current = self.loop.step(stamp, reading.displacement)
        if self.controlled:
            return OFF if current is None else current
        setpoint = self._initialisation.step(
            stamp, reading.coil_current, reading.current_rate, reading.flux_rate
        )
        if self._initialisation.finished:
            self.result = self._initialisation.result()
            table = self._control.table(*self.result.table, self.result.offset_current)
            self.loop.begin(self._control, table, stamp)
        return setpoint
