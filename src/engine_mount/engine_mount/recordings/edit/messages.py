"""Messages as they were recorded, byte for byte, chosen by their log times and written to a new recording."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.edit.inherited_statement import Sources, inherited_statement
from engine_mount.recordings.edit.verbatim import VerbatimBag
from engine_mount.recordings.metadata import TopicInformation
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.series import Payloads, Times
from engine_mount.recordings.stored import StoredTopic
from mount_recorder.losses import RECORDER_RECORD

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
    sequences: NDArray[np.uint32]
    payloads: Payloads

    def __len__(self) -> int:
        return len(self.log_times)

    def chosen(self, places: NDArray[np.int64]) -> 'Messages':
        """Return the messages at `places`."""
        return replace(
            self,
            log_times=self.log_times[places],
            publish_times=self.publish_times[places],
            sequences=self.sequences[places],
            payloads=self.payloads.chosen(places),
        )

    def ordered(self) -> 'Messages':
        """Return the messages in the order of their log times."""
        return self.chosen(np.argsort(self.log_times, kind='stable'))


def joined(topic: TopicInformation, parts: Sequence[Messages]) -> Messages:
    """Return the messages of several parts, of which there is one at least, in the order of log times."""
    return Messages(
        topic,
        next((part.declared for part in parts if part.declared), None),
        np.concatenate([part.log_times for part in parts]),
        np.concatenate([part.publish_times for part in parts]),
        np.concatenate([part.sequences for part in parts]),
        Payloads([part.payloads.messages for part in parts if len(part)]),
    ).ordered()


def read_messages(recording: Recording, name: str) -> tuple[Messages, list[str]]:
    """Return all messages of the topic `name` and what was found damaged on the way.

    A large recording is opened anew, so that the memory holds one topic at a time, not all that were ever
    read.
    """
    known = list(recording.warnings)
    source = open_recording(recording.path) if recording.message_count > _LARGE else recording
    topics = (topic for file in recording.files for topic in file.topics.values())
    declared = next((topic for topic in topics if topic.name == name), None)
    series = source[name]
    columns = series.receive_times, series.publish_times, series.sequences
    messages = Messages(recording.topics[name], declared, *columns, series.payloads).ordered()
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
        bag.copy_beside_messages(recordings)
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
