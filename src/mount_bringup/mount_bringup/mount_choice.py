"""What the chosen mount asks of the control: a parameter of the simulator and the one that belongs to it."""

from collections.abc import Mapping
from typing import Any

from mount_control.settings import defaults
from mount_models.quantity import ParameterError

ALWAYS_ON = 'friction_always_on'
NEEDED = {'policy': 'switched_viscous', 'switching': 'always'}
"""What the mount `ALWAYS_ON` asks of mount_control."""


def seat_of(settings: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the name of the mount in the seat; a real one is a friction mount."""
    return str(settings.get('mount_sim', {}).get('mount', 'friction'))


def with_control_of_mount(settings: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the settings of the nodes with policy and switching as the mount in the seat needs them."""
    completed = {node: dict(values) for node, values in settings.items()}
    if completed.get('mount_sim', {}).get('mount') == ALWAYS_ON:
        completed['mount_control'] = {**NEEDED, **completed.get('mount_control', {})}
    return completed


def check_control_of_mount(settings: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise `ParameterError` if the mount should damp always and the control was not told so."""
    if settings.get('mount_sim', {}).get('mount') != ALWAYS_ON:
        return
    control = {**defaults(), **settings.get('mount_control', {})}
    for name, value in NEEDED.items():
        if control[name] != value:
            raise ParameterError(
                f'mount {ALWAYS_ON} needs mount_control.{name} {value}; instead received {control[name]}'
            )
