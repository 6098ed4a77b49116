"""Messages as they were recorded, byte for byte, chosen by their log times and written to a new recording."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mount_bags.metadata import TopicInformation
from mount_bags.reading import Recording, open_recording
from mount_bags.schemas import SchemaError
from mount_bags.series import Payloads, Series, Times
from mount_bags.writer import BagWriter

_LARGE = 500_000  # messages, chosen: about 100 MB


@dataclass(frozen=True)
class Messages:
    """Messages of one topic in the order of their log times (ns)."""

    topic: TopicInformation
    log_times: Times
    publish_times: Times
    payloads: Payloads

    def __len__(self) -> int:
        return len(self.log_times)

    def chosen(self, places: NDArray[np.int64]) -> 'Messages':
        """Return the messages at `places`."""
        return Messages(
            self.topic, self.log_times[places], self.publish_times[places], _at(self.payloads, places)
        )


def read_messages(recording: Recording, name: str) -> tuple[Messages, list[str]]:
    """Return all messages of the topic `name` and what was found damaged on the way.

    A large recording is opened anew, so that the memory holds one topic at a time, not all that were ever
    read.
    """
    known = list(recording.warnings)
    source = open_recording(recording.path) if recording.message_count > _LARGE else recording
    messages = _in_order(recording.topics[name], source[name])
    return messages, [warning for warning in source.warnings if warning not in known]


def write_messages(writer: BagWriter, parts: Sequence[Messages]) -> list[str]:
    """Write `parts` in the order of their log times and return a sentence for each topic left out.

    Messages of one log time follow in the order of `parts`.
    """
    left_out, writable = [], []
    for part in parts:
        try:
            writer.add_topic(part.topic.name, part.topic.type, part.topic.offered_qos)
        except SchemaError as error:
            left_out.append(f'{part.topic.name} is left out with its {len(part)} messages: {error}')
            continue
        writable.append(part)
    for number, place in _by_log_time([part.log_times for part in writable]):
        part = writable[number]
        log_time, publish_time = int(part.log_times[place]), int(part.publish_times[place])
        writer.write(part.topic.name, part.payloads[place], log_time, publish_time)
    return left_out


def joined_payloads(payloads: Iterable[Payloads]) -> Payloads:
    """Return all `payloads` one behind the other."""
    return Payloads([_pieces(each) for each in payloads if len(each)])


def _in_order(topic: TopicInformation, series: Series) -> Messages:
    messages = Messages(topic, series.receive_times, series.publish_times, series.payloads)
    if (np.diff(messages.log_times) >= 0).all():
        return messages
    return messages.chosen(np.argsort(messages.log_times, kind='stable'))


def _at(payloads: Payloads, places: NDArray[np.int64]) -> Payloads:
    if payloads.rows is not None:
        return Payloads([payloads.rows[places]])
    return Payloads([[payloads[place] for place in places.tolist()]])


def _pieces(payloads: Payloads) -> NDArray[np.uint8] | list[bytes]:
    return payloads.rows if payloads.rows is not None else [payloads[i] for i in range(len(payloads))]


def _by_log_time(times: Sequence[Times]) -> Iterable[tuple[int, int]]:
    """Return (part, place in it) of all messages, sorted by time, then by part."""
    if not times:
        return ()
    numbers = np.repeat(np.arange(len(times)), [len(each) for each in times])
    places = np.concatenate([np.arange(len(each)) for each in times])
    order = np.argsort(np.concatenate(times), kind='stable')
    return zip(numbers[order].tolist(), places[order].tolist(), strict=True)
