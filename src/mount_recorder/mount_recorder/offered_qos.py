"""Quality of service of the publishers of a topic, as YAML of a bag.

A duration without end is 9223372036 s and 854775807 ns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

INFINITE = (1 << 63) - 1  # ns
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class OfferedQos:
    """What one publisher offers; durations in ns. Discovery tells neither history nor depth."""

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False


def qos_documents(offers: Sequence[OfferedQos]) -> list[dict[str, Any]]:
    """Return the offers as plain data in the order of rosbag2's fields, for a YAML document."""
    return [
        {
            'history': offer.history,
            'depth': offer.depth,
            'reliability': offer.reliability,
            'durability': offer.durability,
            'deadline': _duration(offer.deadline),
            'lifespan': _duration(offer.lifespan),
            'liveliness': offer.liveliness,
            'liveliness_lease_duration': _duration(offer.liveliness_lease_duration),
            'avoid_ros_namespace_conventions': offer.avoid_ros_namespace_conventions,
        }
        for offer in offers
    ]


def qos_text(offers: Sequence[OfferedQos]) -> str:
    """Return the YAML list that stands in a channel's metadata; `[]` without offers."""
    return yaml.safe_dump(qos_documents(offers), sort_keys=False).rstrip('\n')


def _duration(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return {'sec': seconds, 'nsec': rest}
