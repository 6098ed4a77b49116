"""Messages as they were recorded, byte for byte, chosen by their log times and written to a new recording."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.bag.recording import Recording, open_recording
from engine_mount.recordings.container.stored import StoredTopic
from engine_mount.recordings.edit.beside_messages import copy_beside_messages
from engine_mount.recordings.edit.inherited_statement import Sources, inherited_statement
from engine_mount.recordings.edit.verbatim import VerbatimBag
from engine_mount.recordings.messages.series import Payloads, Series, Times
from mount_recorder.metadata import TopicInformation
from mount_recorder.statement import RECORDER_RECORD

_LARGE = 500_000  # messages, chosen: about 100 MB


@dataclass(frozen=True)
class Messages:
    """Messages of one topic in the order of their log times (ns).

    `declared` is what their file says of them; None only where there are none.
    """

    topic: TopicInformation
    declared: StoredTopic | None
    log_times: Times
    publish_times: Times
    payloads: Payloads
    sequences: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.log_times)

    def chosen(self, places: NDArray[np.int64]) -> 'Messages':
        """Return the messages at `places`."""
        return Messages(
            self.topic,
            self.declared,
            self.log_times[places],
            self.publish_times[places],
            _at(self.payloads, places),
            self.sequences[places],
        )


def read_messages(recording: Recording, name: str) -> tuple[Messages, list[str]]:
    """Return all messages of the topic `name` and what was found damaged on the way.

    A large recording is opened anew, so that the memory holds one topic at a time, not all that were ever
    read.
    """
    known = list(recording.warnings)
    source = open_recording(recording.path) if recording.message_count > _LARGE else recording
    messages = _in_order(recording.topics[name], _declaration(recording, name), source[name])
    return messages, [warning for warning in source.warnings if warning not in known]


def write_messages(
    folder: str | os.PathLike[str],
    parts: Sequence[Messages],
    recordings: Sequence[Recording],
    sources: Sources,
    custom_data: Mapping[str, str],
    ros_distro: str = '',
) -> int:
    """Write `parts` by their log times to the new recording `folder` and return how many messages these are.

    They are from `recordings`, whose attachments and metadata come with them, and whose recorders lost what
    `sources` tell. Schemas and channels are those of their files, so types need not be installed. If that
    fails, nothing is left behind.
    """
    bag = VerbatimBag(folder)
    try:
        channels = [bag.topic(part.declared) if part.declared else 0 for part in parts]
        for number, place in in_log_order(parts):
            part = parts[number]
            times = int(part.log_times[place]), int(part.publish_times[place])
            bag.write(channels[number], part.payloads[place], *times, int(part.sequences[place]))
        bag.flush()
        copy_beside_messages(recordings, bag)
        if sources:
            bag.add_record(RECORDER_RECORD, inherited_statement(sources, bag.kept_by_topic))
        bag.close(custom_data, ros_distro)
    except BaseException:
        bag.discard()
        raise
    return bag.kept


def in_log_order(parts: Sequence[Messages]) -> Iterable[tuple[int, int]]:
    """Return (number of the part, place in it) of all messages, sorted by log time, then by part."""
    if not parts:
        return ()
    times = [part.log_times for part in parts]
    numbers = np.repeat(np.arange(len(times)), [len(each) for each in times])
    places = np.concatenate([np.arange(len(each)) for each in times])
    order = np.argsort(np.concatenate(times), kind='stable')
    return zip(numbers[order].tolist(), places[order].tolist(), strict=True)


def joined_payloads(payloads: Iterable[Payloads]) -> Payloads:
    """Return all `payloads` one behind the other."""
    return Payloads([_pieces(each) for each in payloads if len(each)])


def _declaration(recording: Recording, name: str) -> StoredTopic | None:
    topics = (topic for file in recording.files for topic in file.topics.values())
    return next((topic for topic in topics if topic.name == name), None)


def _in_order(topic: TopicInformation, declared: StoredTopic | None, series: Series) -> Messages:
    messages = Messages(
        topic, declared, series.receive_times, series.publish_times, series.payloads, series.sequences
    )
    if (np.diff(messages.log_times) >= 0).all():
        return messages
    return messages.chosen(np.argsort(messages.log_times, kind='stable'))


def _at(payloads: Payloads, places: NDArray[np.int64]) -> Payloads:
    if payloads.rows is not None:
        return Payloads([payloads.rows[places]])
    return Payloads([[payloads[place] for place in places.tolist()]])


def _pieces(payloads: Payloads) -> NDArray[np.uint8] | list[bytes]:
    return payloads.rows if payloads.rows is not None else [payloads[i] for i in range(len(payloads))]
