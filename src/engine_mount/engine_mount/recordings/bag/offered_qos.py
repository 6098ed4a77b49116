"""Quality of service of the publishers of a topic, read from a bag.

Old bags hold the policies as the numbers of `rmw/types.h`, newer ones as words; both are read.
"""

import functools
from typing import Any

from mount_models.plain_yaml import plain_yaml
from mount_recorder.offered_qos import NANOSECONDS, OfferedQos

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


def _nanoseconds(document: Any) -> int:
    return int(document['sec']) * NANOSECONDS + int(document['nsec'])
