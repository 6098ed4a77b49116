"""The policies by their names."""

from mount_control.policy import continuous_viscous, pad_probe, switched_viscous
from mount_control.policy.contract import Policy
from mount_models.quantity import ParameterError, nearest

DEFAULT = 'continuous_viscous'
UNPREFIXED = 'switched_viscous'
"""The first policy: its parameters have no prefix, and recordings that name none were made with it."""

DAMPERS: dict[str, Policy] = {
    'switched_viscous': switched_viscous,
    'continuous_viscous': continuous_viscous,
}
POLICIES: dict[str, Policy] = {**DAMPERS, 'pad_probe': pad_probe}
"""The dampers, and what is no damper but a diagnosis."""


def chosen_policy(name: str) -> Policy:
    """Return the policy of this name, or raise `ParameterError` with the known ones."""
    if name not in POLICIES:
        raise ParameterError(f'policy {name!r} is unknown; {nearest(name, POLICIES)}')
    return POLICIES[name]


def prefix_of(name: str) -> str:
    """Return what stands before the names of a policy's parameters; those of the first have none."""
    return '' if name == UNPREFIXED else name
