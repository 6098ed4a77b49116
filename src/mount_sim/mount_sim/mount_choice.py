"""The mount of a simulation in the parameters of a run, and the settings of the control that it needs."""

from collections.abc import Mapping
from typing import Any

from mount_models.quantity import ParameterError
from mount_sim.parameters import SimParameters

ALWAYS_ON = 'friction_always_on'
NEEDED = {'policy': 'switched_viscous', 'switching': 'always'}
"""The parameters of mount_control that the mount `ALWAYS_ON` needs."""

Settings = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}."""


def seat_of(settings: Settings) -> str:
    """Return the name of the mount in the seat; a real one is a friction mount."""
    return str(settings.get('mount_sim', {}).get('mount', SimParameters().mount))


def simulated_mounts(settings: Settings) -> str:
    """Return the places of several simulated mounts, the name of one alone, nothing in a car."""
    sim = settings.get('mount_sim')
    return str(sim.get('mounts') or seat_of(settings)) if sim else ''


def with_control_of_mount(settings: Settings) -> dict[str, dict[str, Any]]:
    """Return the settings of the nodes with policy and switching as the mount in the seat needs them."""
    completed = {node: dict(values) for node, values in settings.items()}
    if seat_of(settings) == ALWAYS_ON:
        completed['mount_control'] = {**NEEDED, **completed.get('mount_control', {})}
    return completed


def check_control_of_mount(settings: Settings) -> None:
    """Raise `ParameterError` if the mount must damp always and the control does not."""
    control = settings.get('mount_control', {})
    for name, value in NEEDED.items() if seat_of(settings) == ALWAYS_ON else ():
        if control.get(name) != value:  # both have other defaults
            raise ParameterError(
                f'mount {ALWAYS_ON} needs mount_control.{name} {value}; instead received '
                f'{control.get(name, "its default")}'
            )
