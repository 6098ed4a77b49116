"""What the recorder says of itself in the recording: how many messages came, how many are there."""

from collections.abc import Mapping
from dataclasses import dataclass

import yaml

RECORDER_RECORD = 'engine_mount_recorder'
"""Name of the metadata in which the recorder says what it received and lost."""


@dataclass(slots=True)
class Reception:
    """Messages of one topic at the recorder."""

    received: int = 0
    overflowed: int = 0  # of these: did not fit into the queue
    missing: int = 0  # samples absent between the stamps: lost before the recorder, or never sent


def statement(receptions: Mapping[str, Reception], kept: Mapping[str, int]) -> dict[str, str]:
    """Return the record of a recording that ought to hold every message received; counts are per topic."""
    lost = {name: entry.received - kept.get(name, 0) for name, entry in receptions.items()}
    return _record(receptions, kept, lost)


def excerpt_statement(receptions: Mapping[str, Reception], kept: Mapping[str, int]) -> dict[str, str]:
    """Return the record of a recording that holds a part of what was received: a snapshot."""
    return _record(receptions, kept, {name: entry.overflowed for name, entry in receptions.items()})


def _record(
    receptions: Mapping[str, Reception], kept: Mapping[str, int], lost: Mapping[str, int]
) -> dict[str, str]:
    topics = {
        name: {
            'received': entry.received,
            'kept': kept.get(name, 0),
            'lost': lost[name],
            'missing': entry.missing,
        }
        for name, entry in receptions.items()
    }
    return {
        'received': str(sum(entry.received for entry in receptions.values())),
        'kept': str(sum(kept.values())),
        'lost': str(sum(lost.values())),
        'topics': yaml.safe_dump(topics, sort_keys=False),
    }
