"""The mounts of a car: their names, and what the parameters of a run are for each of them.

Of a node that every mount has, `left/mount_control` is that of one mount, `mount_control` stands for all;
`mount_sim` is there once, with `mount_left.NAME` for what one mount has for itself.
"""

from collections.abc import Mapping
from typing import Any

from mount_bringup.settings import OF_EACH
from mount_models.quantity import ParameterError

Settings = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}."""

_SIM = 'mount_sim'


def mounts_of(settings: Settings) -> tuple[str, ...]:
    """Return the names of the mounts, none where there is one mount alone; raises `ParameterError`."""
    text = str(settings.get(_SIM, {}).get('mounts', ''))
    names: tuple[str, ...] = ()
    if text:
        from mount_sim.plant.places import mount_names  # not in the car

        names = mount_names(text)
    for node in settings:
        mount, slash, name = node.rpartition('/')
        if slash and (mount not in names or name not in OF_EACH):
            raise ParameterError(
                f'{node!r} is no node of this graph: its mounts are {", ".join(names) or "one alone"}, each '
                f'with {", ".join(OF_EACH)}'
            )
    return names


def settings_of_mount(settings: Settings, mount: str) -> dict[str, dict[str, Any]]:
    """Return the settings as they hold for one mount, by the names that the nodes have where it is alone."""
    found = {node: dict(values) for node, values in settings.items() if '/' not in node}
    for node in OF_EACH:
        if own := settings.get(f'{mount}/{node}'):
            found[node] = {**found.get(node, {}), **own}
    if _SIM in found:
        from mount_sim.plant.places import values_of_mount

        found[_SIM] = values_of_mount(found[_SIM], mount)
    return found


def settings_of_mounts(settings: Settings) -> dict[str, dict[str, dict[str, Any]]]:
    """Return {mount: settings}; a mount alone has the name ''."""
    names = mounts_of(settings)
    return {name: settings_of_mount(settings, name) for name in names} or {
        '': {node: dict(values) for node, values in settings.items()}
    }
