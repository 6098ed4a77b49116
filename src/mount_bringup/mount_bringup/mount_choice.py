"""What the chosen mount asks of the control: a parameter of the simulator and the one that belongs to it."""

from collections.abc import Mapping
from typing import Any

from mount_models.quantity import ParameterError
from mount_sim.parameters import SimParameters

ALWAYS_ON = 'friction_always_on'


def seat_of(settings: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the name of the mount in the seat; a real one is a friction mount."""
    return str(settings.get('mount_sim', {}).get('mount', SimParameters().mount))


def with_control_of_mount(settings: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the settings of the nodes with `mount_control.switching` as the mount in the seat needs it."""
    completed = {node: dict(values) for node, values in settings.items()}
    if completed.get('mount_sim', {}).get('mount') == ALWAYS_ON:
        completed.setdefault('mount_control', {}).setdefault('switching', 'always')
    return completed


def check_control_of_mount(settings: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise `ParameterError` if the mount should damp always and the control was not told so."""
    switching = settings.get('mount_control', {}).get('switching', 'enabled')
    if settings.get('mount_sim', {}).get('mount') == ALWAYS_ON and switching != 'always':
        raise ParameterError(
            f'mount {ALWAYS_ON} needs mount_control.switching always; instead received {switching}'
        )
