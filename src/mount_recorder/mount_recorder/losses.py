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


def loss_statement(
    receptions: Mapping[str, Reception], kept: Mapping[str, int], *, excerpt: bool = False
) -> dict[str, str]:
    """Return the record of a recording that ought to hold every message received; counts are per topic.

    An `excerpt` of a recording lost no more than did not fit into the queue.
    """
    topics = {
        name: {
            'received': entry.received,
            'kept': kept.get(name, 0),
            'lost': entry.overflowed if excerpt else entry.received - kept.get(name, 0),
            'missing': entry.missing,
        }
        for name, entry in receptions.items()
    }
    totals = {key: sum(row[key] for row in topics.values()) for key in ('received', 'lost')}
    return {
        'received': str(totals['received']),
        'kept': str(sum(kept.values())),
        'lost': str(totals['lost']),
        'topics': yaml.safe_dump(topics, sort_keys=False),
    }
