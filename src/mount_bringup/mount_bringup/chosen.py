"""The parts of initialisation and control that the parameters of a run choose, as the nodes choose them."""

from collections.abc import Mapping
from typing import Any

from mount_control.parameters import DEFAULT_DAMPER, ControlParameters, checked_parameters
from mount_control.settings import ControlSettings, control_settings
from mount_models.damper import DamperCurve, damper_curve
from mount_models.quantity import with_flattened
from mount_models.specimen import Specimen
from mount_models.specimen import chosen_specimen as specimen_of

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


def chosen_control(parameters: Parameters) -> ControlSettings:
    """Return what the controller of a run is set up with; a `ValueError` says what cannot be."""
    return control_settings(parameters.get('mount_control', {}), chosen_specimen(parameters, 'mount_control'))
