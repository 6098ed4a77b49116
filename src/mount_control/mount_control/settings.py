"""All that the controller is set up with, checked, from the values of its parameters and the specimen."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from mount_control.force_to_current import CurrentTable, resample
from mount_control.identified import check_fits, identified
from mount_control.parameters import DEFAULT_DAMPER, ControlParameters, checked_parameters
from mount_models.damper import DamperCurve, damper_curve
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.coefficient_check import check_friction
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import flattened, with_flattened
from mount_models.specimen import Specimen

FRICTION = {'friction': FrictionCoefficients(), 'contact': FrictionContact()}
"""The sets of parameters that a specimen may know better, by their prefixes."""
TEXTS = {'damper': DEFAULT_DAMPER, 'parameters_file': '', 'specimen': ''}
"""The parameters that are no numbers of a set, with their defaults."""


class ControlSettings(NamedTuple):
    """Parameters, damper characteristic and the friction that the controller assumes."""

    parameters: ControlParameters
    damper: DamperCurve
    friction: FrictionCoefficients
    contact: FrictionContact

    def table(self, current: ArrayLike, normal_force: ArrayLike, offset_current: float) -> CurrentTable:
        """Return the table of `current` (A) over `normal_force` (N) as a control step looks it up."""
        return resample(current, normal_force, offset_current, self.parameters.highest_current)


def defaults() -> dict[str, Any]:
    """Return {parameter: default} of all parameters that choose the settings."""
    friction = {}
    for prefix, values in FRICTION.items():
        friction.update(flattened(values, prefix))
    return {**flattened(ControlParameters()), **friction, **TEXTS}


def control_settings(values: Mapping[str, Any], specimen: Specimen) -> ControlSettings:
    """Return the settings for {parameter: value}, those not named at their defaults or the specimen's.

    Raises a `ValueError` for what cannot be.
    """
    parameters = checked_parameters(with_flattened(ControlParameters(), values))
    damper = damper_curve(values.get('damper', DEFAULT_DAMPER))
    check_fits(parameters, specimen)
    friction = identified(specimen, FRICTION['friction'], values, 'friction')
    contact = identified(specimen, FRICTION['contact'], values, 'contact')
    check_friction(friction, contact)
    return ControlSettings(parameters, damper, friction, contact)
