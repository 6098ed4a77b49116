"""All that the controller is set up with, checked, from the values of its parameters and the specimen."""

import functools
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, NamedTuple, TypeVar

from numpy.typing import ArrayLike

from mount_control.force_maker import CurrentTable, resample
from mount_control.policy.contract import Design, Policy
from mount_control.policy.registry import DEFAULT, POLICIES, chosen_policy, prefix_of
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact, check_friction
from mount_models.quantity import Quantity, flattened, with_flattened, with_values
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SampleRate, sample_time_ns
from mount_models.specimen import Specimen, SpecimenError
from mount_models.specimen_choice import SpecimenChoice

P = TypeVar('P', bound=NamedTuple)

FRICTION = {'friction': FrictionCoefficients(), 'contact': FrictionContact()}
"""The sets of parameters that a specimen may know better, by their prefixes."""


class ControlParameters(NamedTuple):
    """Name of the policy, rate of the samples, what is believed of them, and the limit of the output."""

    policy: Annotated[
        str, Quantity('word', 'what decides when and how much is damped', words=tuple(POLICIES))
    ] = DEFAULT
    sample_rate: SampleRate = SAMPLE_RATE
    longest_bridge: Annotated[
        float,
        Quantity('s', 'longest gap in the samples that is bridged; a longer one starts afresh', 0.002, 0.1),
    ] = 0.020
    displacement_range: Annotated[
        float, Quantity('m', 'largest believable displacement to either side', 1e-3, 0.1)
    ] = 0.020
    displacement_velocity: Annotated[
        float, Quantity('m/s', 'largest believable velocity of the displacement', 0.1, 100.0)
    ] = 1.0
    displacement_noise: Annotated[
        float, Quantity('m', 'largest believable noise of the displacement', 1e-6, 0.1)
    ] = 5e-5
    displacement_stuck: Annotated[
        float, Quantity('s', 'a noisy displacement that repeats for so long is stuck', 0.01, 10.0)
    ] = 0.05
    engine_speed_timeout: Annotated[
        float,
        Quantity('s', 'a speed of the engine is used for so long, and then taken as not known', 0.02, 1.0),
    ] = 0.1
    highest_current: Annotated[
        float, Quantity('A', 'limit of the setpoint', 0.0, HIGHEST_CURRENT, 'paper, section 3')
    ] = HIGHEST_CURRENT
    shadow: Annotated[
        bool,
        Quantity('truth', 'compare the setpoints of electronics that compute the law themselves'),
    ] = False


class ControlSettings(NamedTuple):
    """Parameters, the policy and what it made of its own, and the friction that the controller assumes."""

    parameters: ControlParameters
    policy: Policy
    design: Design
    friction: FrictionCoefficients
    contact: FrictionContact

    def table(self, current: ArrayLike, normal_force: ArrayLike, offset_current: float) -> CurrentTable:
        """Return the table of `current` (A) over `normal_force` (N) as a control step looks it up."""
        return resample(current, normal_force, offset_current, self.parameters.highest_current)


def parameter_sets() -> list[tuple[str, Any]]:
    """Return (prefix, defaults) of all sets of parameters, those of every policy among them."""
    policies = [(prefix_of(name), policy.Parameters()) for name, policy in POLICIES.items()]
    return [('', ControlParameters()), *policies, *FRICTION.items(), ('', SpecimenChoice())]


def run_time_parameters() -> frozenset[str]:
    """Return the names of what the configured controller takes from the next sample on: the policies' own."""
    sets = (flattened(policy.Parameters(), prefix_of(name)) for name, policy in POLICIES.items())
    return frozenset().union(*sets)


def defaults() -> dict[str, Any]:
    """Return {parameter: default} of all parameters that choose the settings."""
    sets = (flattened(parameters, prefix) for prefix, parameters in parameter_sets())
    return {name: value for each in sets for name, value in each.items()}


def control_settings(values: Mapping[str, Any], specimen: Specimen) -> ControlSettings:
    """Return the settings for {parameter: value}, those not named at their defaults or the specimen's.

    Raises a `ValueError` for what cannot be.
    """
    parameters = with_flattened(ControlParameters(), values)
    sample_time_ns(parameters.sample_rate)  # refuses what the electronics cannot count
    policy, own = policy_parameters(values)
    design = policy.design(own, 1.0 / parameters.sample_rate)
    if parameters.highest_current > specimen.current_limit:
        raise SpecimenError(
            f'highest_current ({parameters.highest_current:.3f} A) must not exceed current_limit '
            f'({specimen.current_limit:.3f} A) of the specimen {specimen.name!r}; lower highest_current'
        )
    friction = _identified(specimen, FrictionCoefficients(), values, 'friction')
    contact = _identified(specimen, FrictionContact(), values, 'contact')
    _check_friction(friction, contact)
    return ControlSettings(parameters, policy, design, friction, contact)


def check_policies(values: Mapping[str, Any]) -> None:
    """Raise a `ValueError` if a policy, chosen or not, could not go on with its {parameter: value}."""
    sample_time = 1.0 / with_flattened(ControlParameters(), values).sample_rate
    for name, policy in POLICIES.items():
        policy.design(with_flattened(policy.Parameters(), values, prefix_of(name)), sample_time)


# It takes some milliseconds, and a replay of many recordings asks for the same again and again.
_check_friction = functools.lru_cache(maxsize=64)(check_friction)


def policy_parameters(values: Mapping[str, Any]) -> tuple[Policy, Any]:
    """Return the policy that {parameter: value} choose, and its own parameters, each within its range."""
    name = with_flattened(ControlParameters(), values).policy
    policy = chosen_policy(name)
    return policy, with_flattened(policy.Parameters(), values, prefix_of(name))


def without_effect(names: Iterable[str], chosen: str) -> str:
    """Return a sentence about the parameters among `names` that belong to another policy, '' without any."""
    for name, policy in POLICIES.items():
        if name != chosen and (idle := sorted({*names} & {*flattened(policy.Parameters(), prefix_of(name))})):
            return (
                f'mount_control: {", ".join(idle)} of the policy {name} would have no effect, for the chosen '
                f'policy is {chosen}; set mount_control.policy to {name}, or leave '
                f'{"it" if len(idle) == 1 else "them"} out'
            )
    return ''


def _identified(specimen: Specimen, defaults: P, values: Mapping[str, Any], prefix: str) -> P:
    """Return the set that holds: what `values` name as `prefix.name`, else the specimen's, else `defaults`.

    What is set holds even where it equals the default.
    """
    known = {name: value for name, value in specimen.friction.items() if name in defaults._fields}
    return with_flattened(with_values(defaults, **known), values, prefix)
