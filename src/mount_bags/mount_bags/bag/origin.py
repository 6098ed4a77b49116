"""Where a recording was made from: a note in its `custom_data`, which rosbag2 keeps in its metadata.

The messages themselves, `session` among them, stay as they were recorded.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from mount_bags.bag.recording import Recording

KEY = 'made_from'


def origin(recording: Recording) -> list[dict[str, Any]]:
    """Return the steps that led to `recording`, oldest first; empty for an original."""
    information = recording.information
    text = information.custom_data.get(KEY, '') if information else ''
    try:
        steps = yaml.safe_load(text)
    except yaml.YAMLError:
        return []
    return [step for step in steps if isinstance(step, dict)] if isinstance(steps, list) else []


def with_step(recordings: Sequence[Recording], step: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data of a recording made of `recordings`: theirs, with one more step."""
    custom: dict[str, str] = {}
    steps: list[dict[str, Any]] = []
    for recording in recordings:
        custom.update(recording.information.custom_data if recording.information else {})
        steps += [earlier for earlier in origin(recording) if earlier not in steps]
    return {**custom, KEY: yaml.safe_dump([*steps, dict(step)], sort_keys=False)}


def short_name(recording: Recording) -> str:
    """Return what a person calls a recording: the run's folder where its own is just `recording`."""
    path = recording.path.absolute()
    return f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name
