"""The parts of initialisation and control that the parameters of a run choose, as the nodes choose them."""

from collections.abc import Mapping
from typing import Any

from mount_control.parameters import ControlParameters
from mount_control.policy import switched_viscous
from mount_control.settings import ControlSettings, control_settings, policy_parameters
from mount_models.damper import DamperCurve, damper_curve
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_models.specimen import Specimen
from mount_models.specimen import chosen_specimen as specimen_of

Parameters = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}, as given to the nodes."""


def control_parameters(parameters: Parameters) -> ControlParameters:
    """Return the controller's parameters of a run that every policy has."""
    return with_flattened(ControlParameters(), parameters.get('mount_control', {}))


def check_policy(parameters: Parameters) -> None:
    """Refuse what the chosen policy cannot work with; raises a `ValueError`."""
    policy, own = policy_parameters(parameters.get('mount_control', {}))
    policy.design(own, SAMPLE_TIME)


def switched_viscous_parameters(parameters: Parameters) -> switched_viscous.Parameters:
    """Return the parameters of the paper's policy in a run, whether it is chosen or not."""
    return with_flattened(switched_viscous.Parameters(), parameters.get('mount_control', {}))


def chosen_damper(parameters: Parameters) -> DamperCurve:
    """Return the damper characteristic of the paper's policy in a run."""
    return damper_curve(switched_viscous_parameters(parameters).damper)


def chosen_specimen(parameters: Parameters, node: str = 'mount_init') -> Specimen:
    """Return the specimen of a run, as `node` loads it."""
    values = parameters.get(node, {})
    return specimen_of(values.get('parameters_file', ''), values.get('specimen', ''))


def chosen_control(parameters: Parameters) -> ControlSettings:
    """Return what the controller of a run is set up with; a `ValueError` says what cannot be."""
    return control_settings(parameters.get('mount_control', {}), chosen_specimen(parameters, 'mount_control'))
