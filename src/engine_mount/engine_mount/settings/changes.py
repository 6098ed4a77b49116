"""The parameters of a run that differ from their defaults."""

from typing import Any

from mount_bringup.settings import Known, defaults_of_nodes
from mount_models.specimen import default_specimen

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
