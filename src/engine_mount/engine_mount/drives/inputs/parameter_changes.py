"""Parameters that were changed while a recording ran: mount_control tells of them on `event`."""

from collections.abc import Collection, Mapping, Sequence

from engine_mount.recordings.recording import Recording
from engine_mount.settings.chosen import Parameters
from mount_ros.messages.event import ParametersChanged, read_change
from mount_ros.topics import EVENT

_NODE = 'mount_control'  # no other takes parameters at run time


def recorded_changes(recording: Recording) -> list[ParametersChanged]:
    """Return the changes of parameters of mount_control in the order of their stamps."""
    if EVENT.name not in recording:
        return []
    found = (read_change(message.data) for message in recording[EVENT.name].messages())
    changes = [change for change in found if change is not None and change.node == _NODE]
    return sorted(changes, key=lambda change: change.time)


def without(changes: Sequence[ParametersChanged], names: Collection[str]) -> list[ParametersChanged]:
    """Return the changes of all parameters but `names`, which are to be other than recorded."""
    kept = [
        change._replace(values={name: value for name, value in change.values.items() if name not in names})
        for change in changes
    ]
    return [change for change in kept if change.values]


def changed(parameters: Parameters, changes: Sequence[ParametersChanged]) -> Parameters:
    """Return the parameters of all nodes after these changes."""
    values: dict[str, Mapping] = dict(parameters)
    for change in changes:
        values[_NODE] = {**values.get(_NODE, {}), **change.values}
    return values
