"""Quality of service of the publishers of a topic, as YAML of a bag and back.

Old bags hold the policies as the numbers of `rmw/types.h`, newer ones as words; both are read, words
are written. A duration without end is 9223372036 s and 854775807 ns.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from mount_models.plain_yaml import plain_yaml

INFINITE = (1 << 63) - 1  # ns
_NANOSECONDS = 1_000_000_000

# The position of a word is its number in rmw/types.h.
_HISTORY = ('system_default', 'keep_last', 'keep_all', 'unknown')
_RELIABILITY = ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available')
_DURABILITY = ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available')
_LIVELINESS = (
    'system_default',
    'automatic',
    'manual_by_node',
    'manual_by_topic',
    'unknown',
    'best_available',
)


class QosError(ValueError):
    """The quality of service in a bag is not understood."""


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


def read_qos(source: Any) -> tuple[OfferedQos, ...]:
    """Return the offers in `source`: YAML text or the list that it holds; raises `QosError`."""
    try:
        return _offers_in(source) if isinstance(source, str) else _offers(source)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise QosError(f'offered quality of service not understood: {reason}') from None


# The topics of a recording, and of many recordings, have the same few texts.
@functools.lru_cache(maxsize=64)
def _offers_in(text: str) -> tuple[OfferedQos, ...]:
    return _offers(plain_yaml(text))


def _offers(documents: Any) -> tuple[OfferedQos, ...]:
    return tuple(_offer(document) for document in documents or ())


def _offer(document: Any) -> OfferedQos:
    return OfferedQos(
        history=_word(document['history'], _HISTORY),
        depth=int(document['depth']),
        reliability=_word(document['reliability'], _RELIABILITY),
        durability=_word(document['durability'], _DURABILITY),
        deadline=_nanoseconds(document['deadline']),
        lifespan=_nanoseconds(document['lifespan']),
        liveliness=_word(document['liveliness'], _LIVELINESS),
        liveliness_lease_duration=_nanoseconds(document['liveliness_lease_duration']),
        avoid_ros_namespace_conventions=bool(document['avoid_ros_namespace_conventions']),
    )


def _word(value: Any, words: tuple[str, ...]) -> str:
    if isinstance(value, int):
        if not 0 <= value < len(words):
            raise ValueError(f'policy {value} is none of {", ".join(words)}')
        return words[value]
    return str(value)


def _duration(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, _NANOSECONDS)
    return {'sec': seconds, 'nsec': rest}


def _nanoseconds(document: Any) -> int:
    return int(document['sec']) * _NANOSECONDS + int(document['nsec'])
