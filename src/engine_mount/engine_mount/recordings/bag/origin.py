"""Where a recording was made from: a note in its `custom_data`, which rosbag2 keeps in its metadata.

The messages themselves, `session` among them, stay as they were recorded.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import yaml

from mount_models.plain_yaml import YamlError, plain_yaml
from mount_recorder.metadata import BagInformation

KEY = 'made_from'
ZERO_KEY = 'zero_ns'
"""Key of a step: the zero of the time axis, for a piece keeps the time of what it was cut from."""


def origin(information: BagInformation | None) -> list[dict[str, Any]]:
    """Return the steps that led to a recording, oldest first; empty for an original."""
    text = information.custom_data.get(KEY, '') if information else ''
    try:
        steps = plain_yaml(text)
    except YamlError:
        return []
    return [step for step in steps if isinstance(step, dict)] if isinstance(steps, list) else []


def with_step(sources: Iterable[BagInformation | None], step: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data of a recording made of others: theirs, with one more step."""
    custom: dict[str, str] = {}
    steps: list[dict[str, Any]] = []
    for information in sources:
        custom.update(information.custom_data if information else {})
        steps += [earlier for earlier in origin(information) if earlier not in steps]
    return {**custom, KEY: yaml.safe_dump([*steps, dict(step)], sort_keys=False)}
