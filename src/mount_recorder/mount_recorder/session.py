"""The session of a recording, what it is, as YAML on the topic `session`, made and written.

Its keys are `scenario`, `mode`, `started`, `parameters` (by node) and `versions`; of a replay also `replay`.
"""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

import yaml

from mount_recorder.versions import versions


def new_session(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the session of a run that starts now: `content` with the time and the versions."""
    return {**content, 'started': time_text(), 'versions': versions()}


def time_text() -> str:
    """Return the present time with its zone, ISO 8601."""
    return datetime.now().astimezone().isoformat(timespec='seconds')


def session_text(content: Mapping[str, Any]) -> str:
    """Return the text of the session message."""
    return yaml.safe_dump(dict(content), sort_keys=False)
