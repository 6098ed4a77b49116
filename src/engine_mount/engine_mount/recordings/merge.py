"""Several recordings of one drive, such as its cuts, as one."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_mount.recordings.bag_copy import BagCopy, Messages, read_messages
from engine_mount.recordings.metadata import with_step
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Payloads
from engine_mount.recordings.session import session_differences
from mount_recorder.session import time_text
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import SESSION

_LISTED = 4  # differences of sessions in a refusal


class MergeError(ValueError):
    """Recordings do not fit together; the text says where and what to do."""


@dataclass(frozen=True)
class Merge:
    """What was merged: messages written, and those that stood in more than one part."""

    folder: Path
    messages: int
    repeated: int
    losses: tuple[str, ...]  # what of the parts could not be read, in sentences


def merge(
    recordings: Sequence[Recording], out: str | os.PathLike[str], *, different_sessions: bool = False
) -> Merge:
    """Write all messages of `recordings` by log time to the new recording `out`, each message once.

    A message is the same where topic, times and bytes are; one that a recording itself has twice stays
    there twice. Attachments and metadata come with them, each once, and what their recorders lost adds up.
    Raises `MergeError` where a topic has two types, and where the sessions differ unless
    `different_sessions`.
    """
    if not recordings:
        raise MergeError('nothing to merge; name the recordings')
    _check_types(recordings)
    if not different_sessions:
        _refuse_different_sessions(recordings)
    known = [list(recording.warnings) for recording in recordings]
    parts, repeated = [], 0
    read: list[dict[str, int]] = [{} for _ in recordings]
    for name in dict.fromkeys(name for recording in recordings for name in recording):
        found = []
        for recording, counts in zip(recordings, read, strict=True):
            messages = read_messages(recording, name) if name in recording.topics else None
            if messages is not None:
                counts[name] = len(messages)
                found.append(messages)
        if found:
            parts.append(_united(found))
            repeated += sum(map(len, found)) - len(parts[-1])
    step = {
        'did': 'merge',
        'recordings': [recording.short_name for recording in recordings],
        'made': time_text(),
    }
    losses = [
        warning
        for recording, before in zip(recordings, known, strict=True)
        for warning in recording.warnings
        if warning not in before
    ]
    with BagCopy(out) as bag:
        bag.add(parts)
        bag.complete(recordings, read, with_step([recording.information for recording in recordings], step))
    return Merge(Path(out), bag.added, repeated, (*losses, *bag.notes))


def _check_types(recordings: Sequence[Recording]) -> None:
    types: dict[str, tuple[str, str]] = {}
    for recording in recordings:
        for name, topic in recording.topics.items():
            known, known_hash = types.setdefault(name, (topic.type, topic.type_hash))
            if known != topic.type:
                raise MergeError(
                    f'{name} is {known} in one recording and {topic.type} in {recording.path}; '
                    'they are no parts of one drive'
                )
            if known_hash and topic.type_hash and known_hash != topic.type_hash:
                raise MergeError(f'{name}: {known} has another definition in {recording.path}')


def _refuse_different_sessions(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of which one has no session that the first has as well."""
    first, *others = [(recording, _sessions(recording)) for recording in recordings]
    for other, sessions in others:
        if first[1] & sessions or not (first[1] or sessions):
            continue
        why = f'{(other if first[1] else first[0]).path} has no session that says what it is'
        if first[1] and sessions:
            differences = session_differences(min(first[1]), min(sessions))
            why = ': '.join(['their sessions differ', '; '.join(differences[:_LISTED])])
        raise MergeError(
            f'{first[0].path} and {other.path} may be different drives: {why}; '
            'merge them with --different-sessions'
        )


def _sessions(recording: Recording) -> set[str]:
    """Return the texts of all session messages in a recording."""
    names = [name for name in recording if registered_topic(name, recording.topics[name].type) is SESSION]
    return {message.data for name in names for message in recording[name].messages()}


def _united(parts: Sequence[Messages]) -> Messages:
    """Return the messages of all parts without those that an earlier part has as well.

    Each part may repeat what the others have as often as the one that has it most often.
    """
    times, counts = np.unique(
        np.concatenate([np.unique(part.heads['log_time']) for part in parts]), return_counts=True
    )
    most, kept = Counter[tuple[int, int, bytes]](), []
    for part in parts:
        own = Counter[tuple[int, int, bytes]]()
        is_new = np.ones(len(part), bool)
        log_times, sent = part.heads['log_time'], part.heads['publish_time']
        for place in np.flatnonzero(np.isin(log_times, times[counts > 1])).tolist():
            key = int(log_times[place]), int(sent[place]), part.payloads[place]
            own[key] += 1
            is_new[place] = own[key] > most[key]
        most |= own
        kept.append(part.at(np.flatnonzero(is_new)))
    payloads = Payloads([part.payloads.messages for part in kept if len(part)])
    united = Messages(parts[0].topic, np.concatenate([part.heads for part in kept]), payloads)
    return united.at(np.argsort(united.heads['log_time'], kind='stable'))
