"""Reference recordings: short drives in the repository whose setpoints a replay must meet to the bit."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import yaml

from engine_mount.recordings.bag_copy import BagCopy, Messages, read_messages
from engine_mount.recordings.compare import compare
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.series import Payloads
from engine_mount.recordings.session import recorded_session, session_content
from mount_models.plain_yaml import yaml_in_file
from mount_recorder.session import session_text, time_text
from mount_ros.messages.cdr import string_message
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


ACCEPTED_NAME = 'accepted.yaml'
_CHUNK_SIZE = 1 << 20  # bytes, chosen: a tenth smaller than with the recorder's chunks
_INPUTS = (SESSION, EVENT, AIR_GAP, CURRENT_FORCE_TABLE, DISPLACEMENT, COIL_RIPPLE, COIL_TEMPERATURE)
_NAME = re.compile(r'[a-z][a-z0-9_]*')


class AcceptError(ValueError):
    """A recording cannot become a reference; the text says why and what to do."""


class Accepted(NamedTuple):
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
    changes: list[str] = []
    if before is not None:
        comparison = compare(before, run, topics=(*_INPUTS, *ANSWERS), common_only=True)
        if comparison.equal and not comparison.sessions:
            raise AcceptError(f'{run.path} is equal to {before.path} to the bit; there is nothing to accept')
        changes = comparison.sentences()
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder, prefix='.') as made:
        new = Path(made, name)
        with BagCopy(new, _CHUNK_SIZE) as bag:
            bag.add(parts)
            bag.complete()
        entry = {
            'date': time_text(),
            'reason': reason.strip(),
            'recording': run.short_name,
            'versions': dict(versions or {}),
            'changes': changes or ['new reference'],
        }
        earlier = target / ACCEPTED_NAME
        entries = [*((yaml_in_file(earlier) or []) if earlier.is_file() else []), entry]
        history = yaml.safe_dump(entries, sort_keys=False, allow_unicode=True, width=100)
        (new / ACCEPTED_NAME).write_text(history, encoding='utf-8')
        if target.exists():
            target.rename(Path(made, 'before'))
        new.rename(target)
    return Accepted(target, _size(target), sum(map(_size, folder.iterdir())), tuple(changes))


def _parts(run: Recording, before: Recording | None) -> list[Messages]:
    parts: dict[Topic, Messages] = {}
    for topic in (*_INPUTS, *ANSWERS):
        for source in [run] if topic in ANSWERS else [run, before]:
            if topic not in parts and source is not None and topic.name in source:
                name = source.resolve(topic.name)
                messages = read_messages(source, name)
                if messages is not None and len(messages):
                    parts[topic] = replace(messages, topic=messages.topic._replace(name=f'/{topic.name}'))
    for topic in (*ANSWERS, DISPLACEMENT, AIR_GAP, CURRENT_FORCE_TABLE):
        if topic not in parts:
            raise AcceptError(f'{run.path} has no {topic.name}, without which nothing can be replayed')
    has_displacement = DISPLACEMENT.name in run and len(run[DISPLACEMENT.name])
    source = run if has_displacement or before is None else before
    stamps = source[DISPLACEMENT.name].stamps
    for topic in ANSWERS:
        without = np.setdiff1d(run[topic.name].stamps, stamps)
        if len(without):
            raise AcceptError(
                f'{len(without)} samples of {topic.name} answer none of the displacements in {source.path}: '
                f'{run.path} is no replay of it, or samples were lost'
            )
    last = parts[AIR_GAP].heads['log_time'][-1]
    for topic in (COIL_RIPPLE, COIL_TEMPERATURE):  # behind the last air gap the initialisation needs none
        if topic in parts:
            parts[topic] = parts[topic].at(np.flatnonzero(parts[topic].heads['log_time'] <= last))
    if SESSION in parts:
        session = parts[SESSION].at(np.array([len(parts[SESSION]) - 1]))
        content = session_content(recorded_session(run) or recorded_session(before or run))
        shortened = string_message(session_text(_shortened(content)))
        parts[SESSION] = replace(session, payloads=Payloads([[shortened]]))
    return list(parts.values())


def _shortened(content: Any) -> Any:
    """Return a session with absolute paths cut to their last part: they mean nothing elsewhere."""
    if isinstance(content, dict):
        return {key: _shortened(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_shortened(value) for value in content]
    if isinstance(content, str) and content.startswith('/') and len(Path(content).parts) > 2:
        return Path(content).name
    return content


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob('*') if path.is_file())
