"""The parameters of a run that differ from their defaults."""

from collections.abc import Mapping
from typing import Any

from mount_bringup.settings import defaults_of_nodes
from mount_models.specimen import default_specimen

_OF_THE_RUN = {'uri', 'lockstep', 'interface', 'channel', 'port'}
"""Parameters that a run chooses by itself."""


def changed_parameters(parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, tuple[Any, Any]]]:
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
    changed = {
        node: {
            name: (value, defaults[node][name])
            for name, value in values.items()
            if name in defaults.get(node, {})
            and name not in _OF_THE_RUN
            and _differs(value, defaults[node][name])
        }
        for node, values in parameters.items()
    }
    return {node: own for node, own in changed.items() if own}


def _differs(value: Any, default: Any) -> bool:
    both_unknown = value != value and default != default
    if isinstance(default, tuple):
        return bool(value) and tuple(value) != default
    return not both_unknown and value != default
