"""Which mount a recording was made with."""

from collections.abc import Mapping
from typing import Any


def simulated_mounts(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the simulated mounts of a session: their places, of one its name; empty in a car."""
    told = parameters.get('mount_sim', {})
    if not told or told.get('mounts') or told.get('mount'):
        return str(told.get('mounts') or told.get('mount', ''))
    from mount_bringup.mount_choice import (
        seat_of,
    )  # takes half a second to load, for a run that names no mount

    return seat_of(parameters)
