"""Reference recordings: short drives in the repository whose setpoints a replay must meet to the bit."""

import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from engine_mount.recordings.bag_copy import Messages, in_log_order, read_messages
from engine_mount.recordings.compare import Comparison, compare
from engine_mount.recordings.difference import time_text as moment_text
from engine_mount.recordings.metadata import readable_qos
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.series import Payloads
from engine_mount.recordings.session import recorded_session, session_content
from engine_mount.recordings.times import Times, distinct
from mount_models.plain_yaml import YamlError, yaml_in_file
from mount_recorder.bag_writer import BagWriter
from mount_recorder.session import session_message, session_text, time_text
from mount_ros.topics import (
    AIR_GAP,
    COIL_RIPPLE,
    COIL_TEMPERATURE,
    CONTROL_TRACE,
    CURRENT_FORCE_TABLE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    EVENT,
    SESSION,
    Topic,
)

ANSWERS = (CURRENT_SETPOINT, CONTROL_TRACE)
"""What a replay makes."""


def differences_from_reference(
    reference: Recording | str | os.PathLike[str], replayed: Recording | str | os.PathLike[str]
) -> list[str]:
    """Return how the answers in `replayed` differ from those in `reference`, in words; empty when to the bit.

    Compared are `current_setpoint` and `control_trace` by their stamps. From the first traced sample on
    every answer must be there and no other; of the ramp before it those that both have are compared. Raises
    `ReadingError` or `ComparisonError` where that cannot be told.
    """
    a, b = _opened(reference), _opened(replayed)
    comparison = compare(a, b, topics=ANSWERS)
    if not comparison.alignment.same_stamps:
        return ['the replay has other stamps than the reference: it answers other samples']
    sentences = comparison.difference_sentences()
    for topic in ANSWERS:
        sentences += _unmatched(a, b, topic, comparison)
    return sentences


def _opened(recording: Recording | str | os.PathLike[str]) -> Recording:
    return recording if isinstance(recording, Recording) else open_recording(recording)


def _unmatched(a: Recording, b: Recording, topic: Topic, comparison: Comparison) -> list[str]:
    traced = a[CONTROL_TRACE.name].stamps
    if not len(traced):
        return ['the reference holds no control_trace: there is nothing to meet']
    # When mount_control is deactivated it answers its last sample a second time, with 0 A; so unique.
    stamps_a, stamps_b = (_since(recording, topic, int(traced.min())) for recording in (a, b))
    sentences = []
    for here, there, where in ((stamps_a, stamps_b, 'the replay'), (stamps_b, stamps_a, 'the reference')):
        missing = np.setdiff1d(here, there)
        if len(missing):
            first = moment_text(float(comparison.alignment.axis.of_stamps(missing[:1])[0]))
            sentences.append(
                f'{len(missing)} samples of {topic.name} are missing in {where}, first at {first}'
            )
    return sentences


def _since(recording: Recording, topic: Topic, first: int) -> Times:
    if topic.name not in recording:
        return np.empty(0, np.int64)
    stamps = distinct(recording[topic.name].stamps)
    return stamps[stamps >= first]


ACCEPTED_NAME = 'accepted.yaml'
LARGEST_TOTAL = 5_000_000  # bytes, chosen: of all reference recordings together
_CHUNK_SIZE = 1 << 20  # bytes, chosen: a tenth smaller than with the recorder's chunks
_INPUTS = (SESSION, EVENT, AIR_GAP, CURRENT_FORCE_TABLE, DISPLACEMENT, COIL_RIPPLE, COIL_TEMPERATURE)
_NAME = re.compile(r'[a-z][a-z0-9_]*')


class AcceptError(ValueError):
    """A recording cannot become a reference; the text says why and what to do."""


@dataclass(frozen=True)
class Accepted:
    """A reference recording as it stands now; sizes in bytes."""

    folder: Path
    size: int
    total: int  # of all reference recordings
    changes: tuple[str, ...]  # from the reference before; empty for a new one


def accept(
    run: Recording, name: str, reason: str, folder: Path, versions: Mapping[str, str] | None = None
) -> Accepted:
    """Make the reference `name` in `folder` from `run`, with `reason`; raises `AcceptError`.

    Kept is only what a replay needs and makes. Where `run` is itself a replay and lacks inputs, those of the
    reference before are kept. Before anything is replaced, the new one is complete.
    """
    if not reason.strip():
        raise AcceptError('a reference is renewed only with a reason; give it by --reason "..."')
    if not _NAME.fullmatch(name):
        raise AcceptError(f'{name!r} is no name of a reference; use small letters, digits and _')
    target = folder / name
    before = open_recording(target) if target.exists() else None
    parts = _parts(run, before)
    changes = _changes(before, run) if before is not None else []
    made = folder / f'.{name}.new'
    shutil.rmtree(made, ignore_errors=True)
    try:
        made.mkdir(parents=True)
        _write(made / name, parts)
        _write_history(made / name, target, _entry(run, reason, versions or {}, changes))
        size = _size(made / name)
        total = size + sum(_size(p) for p in folder.iterdir() if p.is_dir() and p not in (target, made))
        if total > LARGEST_TOTAL:
            raise AcceptError(
                f'all references would have {total / 1e6:.1f} MB, {name} {size / 1e6:.1f} MB of it; '
                f'the limit is {LARGEST_TOTAL / 1e6:g} MB: drive a shorter one'
            )
        _replace(made / name, target, folder / f'.{name}.old')
    finally:
        shutil.rmtree(made, ignore_errors=True)
    return Accepted(target, size, total, tuple(changes))


def _parts(run: Recording, before: Recording | None) -> list[Messages]:
    for topic in ANSWERS:
        if not _has(run, topic):
            raise AcceptError(f'{run.path} has no {topic.name}; a reference is a drive with its answers')
    parts = {}
    for topic in (*_INPUTS, *ANSWERS):
        source = run if _has(run, topic) else before
        if source is not None and _has(source, topic):
            messages = read_messages(source, source.resolve(topic.name))
            assert messages is not None
            parts[topic] = replace(messages, topic=replace(messages.topic, name=f'/{topic.name}'))
    for topic in (DISPLACEMENT, AIR_GAP, CURRENT_FORCE_TABLE):
        if topic not in parts:
            raise AcceptError(f'{run.path} has no {topic.name}, without which nothing can be replayed')
    source = run if _has(run, DISPLACEMENT) else before
    _check_answers(run, source)
    for topic in (COIL_RIPPLE, COIL_TEMPERATURE):
        if topic in parts:
            parts[topic] = _of_the_ramp(parts[topic], parts[AIR_GAP])
    if SESSION in parts:
        parts[SESSION] = _without_paths(parts[SESSION], run if _has(run, SESSION) else before)
    return list(parts.values())


def _has(recording: Recording, topic: Topic) -> bool:
    return topic.name in recording and recording.topics[recording.resolve(topic.name)].message_count > 0


def _check_answers(run: Recording, inputs: Recording | None) -> None:
    assert inputs is not None
    stamps = inputs[DISPLACEMENT.name].stamps
    for topic in ANSWERS:
        without = np.setdiff1d(run[topic.name].stamps, stamps)
        if len(without):
            raise AcceptError(
                f'{len(without)} samples of {topic.name} answer none of the displacements in {inputs.path}: '
                f'{run.path} is no replay of it, or samples were lost'
            )


def _of_the_ramp(messages: Messages, air_gap: Messages) -> Messages:
    """Return the messages up to the last air gap: the initialisation needs none behind it."""
    return messages.at(np.flatnonzero(messages.heads['log_time'] <= air_gap.heads['log_time'][-1]))


def _without_paths(session: Messages, source: Recording | None) -> Messages:
    """Return the last session with absolute paths cut to their last part: they mean nothing elsewhere."""
    assert source is not None
    content = session_content(recorded_session(source))
    shortened = _shortened(content)
    last = session.at(np.array([len(session) - 1]))
    if shortened == content:
        return last
    return replace(last, payloads=Payloads([[session_message(session_text(shortened))]]))


def _shortened(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _shortened(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_shortened(value) for value in content]
    if isinstance(content, str) and content.startswith('/') and len(Path(content).parts) > 2:
        return Path(content).name
    return content


def _changes(before: Recording, run: Recording) -> list[str]:
    comparison = compare(before, run, topics=(*_INPUTS, *ANSWERS), common_only=True)
    if comparison.equal and not comparison.sessions:
        raise AcceptError(f'{run.path} is equal to {before.path} to the bit; there is nothing to accept')
    return comparison.sentences()


def _entry(run: Recording, reason: str, versions: Mapping[str, str], changes: list[str]) -> dict[str, Any]:
    return {
        'date': time_text(),
        'reason': reason.strip(),
        'recording': run.short_name,
        'versions': dict(versions),
        'changes': changes or ['new reference'],
    }


def _write(folder: Path, parts: list[Messages]) -> None:
    writer = BagWriter(folder, chunk_size=_CHUNK_SIZE)
    for part in parts:
        offers = readable_qos(part.topic.details.get('offered_qos_profiles', ''))
        writer.add_topic(part.topic.name, part.topic.type, offers)
    for number, place in in_log_order(parts):
        part, head = parts[number], parts[number].heads[place]
        writer.write(part.topic.name, part.payloads[place], int(head['log_time']), int(head['publish_time']))
    writer.close()


def _write_history(made: Path, target: Path, entry: dict[str, Any]) -> None:
    earlier = target / ACCEPTED_NAME
    try:
        entries = (yaml_in_file(earlier) or []) if earlier.is_file() else []
    except YamlError as error:
        raise AcceptError(f'{earlier} {error}') from None
    if not isinstance(entries, list):
        raise AcceptError(f'{earlier} must be a list of entries; restore it from the repository')
    text = yaml.safe_dump([*entries, entry], sort_keys=False, allow_unicode=True, width=100)
    (made / ACCEPTED_NAME).write_text(text, encoding='utf-8')


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob('*') if path.is_file())


def _replace(made: Path, target: Path, aside: Path) -> None:
    if target.exists():
        shutil.rmtree(aside, ignore_errors=True)
        target.rename(aside)
    made.rename(target)
    shutil.rmtree(aside, ignore_errors=True)
