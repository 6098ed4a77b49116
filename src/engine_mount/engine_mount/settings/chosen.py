"""Controller, policy and specimen that a run chooses, and its parameters that differ from their defaults."""

from collections.abc import Mapping
from typing import Any

from mount_bringup.settings import Known, defaults_of_nodes
from mount_control.policy.contract import Policy
from mount_control.policy.registry import UNPREFIXED
from mount_control.settings import (
    ControlParameters,
    ControlSettings,
    control_settings,
    policy_parameters,
    without_effect,
)
from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters
from mount_models.quantity import ParameterError, with_flattened
from mount_models.specimen import Specimen, default_specimen
from mount_models.specimen import chosen_specimen as specimen_of

Parameters = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}, as given to the nodes."""


class NoEffectError(ParameterError):
    """A parameter belongs to another policy than the chosen one; the text names both."""


def check_effect(values: Mapping[str, Any], chosen: str = '') -> None:
    """Raise `NoEffectError` if {parameter: value} name one of another policy than the chosen one.

    The chosen policy is the one in `values`, else `chosen`, else the default. On the desk such a parameter
    is a mistake.
    """
    policy = values.get('policy') or chosen or ControlParameters().policy
    if sentence := without_effect(values, policy):
        raise NoEffectError(sentence)


def control_parameters(parameters: Parameters) -> ControlParameters:
    """Return the controller's parameters of a run that every policy has."""
    return with_flattened(ControlParameters(), parameters.get('mount_control', {}))


def check_policy(parameters: Parameters) -> None:
    """Refuse parameters with which the chosen policy cannot work; raises a `ValueError`."""
    policy, own = policy_of(parameters)
    policy.design(own, 1.0 / control_parameters(parameters).sample_rate)


def policy_of(parameters: Parameters) -> tuple[Policy, Any]:
    """Return the policy of a run and its own parameters."""
    return policy_parameters(parameters.get('mount_control', {}))


def with_recorded_policy(parameters: Parameters) -> dict[str, dict[str, Any]]:
    """Return the parameters of a session; one that names no policy was made with the first."""
    named = {node: dict(values) for node, values in parameters.items()}
    named.setdefault('mount_control', {}).setdefault('policy', UNPREFIXED)
    return named


def chosen_specimen(parameters: Parameters, node: str = 'mount_init') -> Specimen:
    """Return the specimen of a run, as `node` loads it."""
    values = parameters.get(node, {})
    return specimen_of(values.get('parameters_file', ''), values.get('specimen', ''))


def chosen_initialisation(
    parameters: Parameters, temperatures: TemperatureReadings | None = None
) -> Initialisation:
    """Return a ramp of mount_init before its first sample; `temperatures` are those of the coil."""
    own = with_flattened(InitParameters(), parameters.get('mount_init', {}))
    return Initialisation(chosen_specimen(parameters), own, temperatures or TemperatureReadings())


def chosen_control(parameters: Parameters) -> ControlSettings:
    """Return what the controller of a run is set up with; a `ValueError` says what cannot be."""
    return control_settings(parameters.get('mount_control', {}), chosen_specimen(parameters, 'mount_control'))


_OF_THE_RUN = {'uri', 'lockstep', 'interface', 'channel', 'port'}
"""Parameters that a run chooses by itself."""


def changed_parameters(parameters: Known) -> dict[str, dict[str, tuple[Any, Any]]]:
    """Return {node: {parameter: (value, default)}} of a session that differ from the default.

    Of friction and contact the default is what the shipped specimen says of this actuator.
    """
    defaults = defaults_of_nodes()
    identified = default_specimen().friction
    control = defaults['mount_control']
    for name in control:
        prefix, _, rest = name.partition('.')
        if prefix in ('friction', 'contact') and rest in identified:
            control[name] = identified[rest]
    changed = {}
    for node, values in parameters.items():
        own = defaults.get(node, {})
        names = [name for name in values if name in own and name not in _OF_THE_RUN]
        changed[node] = {
            name: (values[name], own[name]) for name in names if _differs(values[name], own[name])
        }
    return {node: pairs for node, pairs in changed.items() if pairs}


def _differs(value: Any, default: Any) -> bool:
    if isinstance(default, tuple):
        return bool(value) and tuple(value) != default
    return value != default and not (value != value and default != default)  # NaN is unknown
