"""The mounts of a car in the settings of a run.

Of a node that every mount has, `left/mount_control` is that of one mount, `mount_control` stands for all;
`mount_sim` is there once, with `mount_left.NAME` for what one mount has for itself.
"""

from typing import Any

from mount_bringup.settings import OF_EACH, Known, settings_of_mount
from mount_models.quantity import ParameterError
from mount_sim.plant.mounts import mount_names


def mounts_of(settings: Known) -> tuple[str, ...]:
    """Return the names of the mounts, none where there is one mount alone; raises `ParameterError`."""
    names = mount_names(str(settings.get('mount_sim', {}).get('mounts', '')))
    for node in settings:
        mount, slash, name = node.rpartition('/')
        if slash and (mount not in names or name not in OF_EACH):
            raise ParameterError(
                f'{node!r} is no node of this graph: its mounts are {", ".join(names) or "one alone"}, each '
                f'with {", ".join(OF_EACH)}'
            )
    return names


def settings_of_mounts(settings: Known) -> dict[str, dict[str, dict[str, Any]]]:
    """Return {mount: settings}; a mount alone has the name ''."""
    return {name: settings_of_mount(settings, name) for name in mounts_of(settings) or ('',)}
