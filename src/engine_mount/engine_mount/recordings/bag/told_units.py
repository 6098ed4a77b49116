"""Units of a topic's fields, read from the metadata of its MCAP channel."""

import json
from collections.abc import Mapping

from mount_recorder.told_units import KEY


def units_in(details: Mapping[str, str]) -> dict[str, str]:
    """Return the units by field that a channel's metadata tell, {} where it tells none that is understood."""
    try:
        told = json.loads(details.get(KEY, '{}'))
    except json.JSONDecodeError:
        return {}
    return {str(name): str(unit) for name, unit in told.items()} if isinstance(told, dict) else {}
