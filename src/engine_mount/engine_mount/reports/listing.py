"""Which recordings there are, from the ends of their files, and what one of them is and holds."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from engine_mount.recordings.audit import audit
from engine_mount.recordings.events import read_marks
from engine_mount.recordings.losses import losses
from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.screen import Table
from engine_mount.recordings.session import (
    duration_of,
    session_parameters,
    started_of,
    told_session,
    version_differences,
    versions_sentence,
    versions_told,
)
from engine_mount.settings.changes import changed_parameters
from engine_mount.settings.run_folder import RunFolder
from engine_mount.signals.sources.stores import entries
from engine_mount.signals.sources.uris import inside, is_local, local_path
from mount_recorder.metadata import METADATA_NAME
from mount_recorder.versions import versions
from mount_ros.topics import AIR_GAP, EVENT
from mount_sim.plant.mounts import simulated_mounts

_COUNTS = {
    'lost_samples': 'samples lost',
    'lost_messages': 'messages lost',
    'unanswered_samples': 'samples unanswered',
    'misdated_messages': 'messages misdated',
    'faults': 'faults',
    'restarts': 'nodes started again',
}
_UNKNOWN = dict.fromkeys(('started', 'duration_s', 'scenario', 'mode', 'mount', 'policy'))
_VERSIONS = ('mount_bringup', 'rclpy', 'python', 'numpy')  # printed

Figures = dict[str, Any]


class Description(NamedTuple):
    """What a recording is and holds: figures in SI units as JSON knows them, and the same for people."""

    figures: Figures
    rows: list[tuple[str, str]]  # label and text, a sentence without label
    tables: list[Table]


def list_recordings(folders: Sequence[Path | str]) -> list[Figures]:
    """Return the recordings in `folders`, and those that these are themselves, the newest first.

    A folder is a path or a URI; in a store only names and sizes are read. `sound` is None where no summary of
    a run says whether anything was lost or went wrong. Raises `SourceError` where a store cannot be listed.
    """
    found = [one for folder in folders for one in _recordings_at(str(folder))]
    return sorted(found, key=lambda one: _seconds(one['started']), reverse=True)


def summarise_recording(path: Path) -> Figures:
    """Return what is known of the run or recording at `path`, as its verdict where it cannot be read."""
    try:
        recording = open_run(path)
        session = told_session(recording)
    except (ReadingError, OSError) as error:
        return {'recording': str(path), **_UNKNOWN, 'verdict': str(error), 'sound': False}
    parameters = session_parameters(session)
    scenario = str(session.get('scenario', ''))
    verdict, sound = _verdict(path, recording)
    return {
        **_head(recording, session),
        'recording': str(path),
        'scenario': (f'replay of {scenario}'.strip() if 'replay' in session else scenario) or None,
        'mode': str(session.get('mode', '')) or None,
        'mount': simulated_mounts(parameters) or None,
        'policy': str(parameters.get('mount_control', {}).get('policy', '')) or None,
        'verdict': verdict,
        'sound': sound,
    }


def describe_recording(recording: Recording) -> Description:
    """Return what a recording is and holds; every message is looked at, for the losses."""
    session = told_session(recording)
    audits = audit(recording)
    found = losses(recording, audits)
    head, made_with = _head(recording, session), versions_told(session)
    changed = changed_parameters(session_parameters(session))
    gaps, marks = _gaps(recording), _marks(recording)
    figures = {
        **head,
        'scenario': session.get('scenario'),
        'mode': session.get('mode'),
        'replay': 'replay' in session,
        'mounts': [mount for mount in recording.mounts if mount],
        'whole': recording.whole,
        'versions': made_with,
        'changed_parameters': {
            node: {
                name: {'value': _plain(value), 'default': _plain(default)}
                for name, (value, default) in own.items()
            }
            for node, own in changed.items()
        },
        'gaps': {mount: {name: _plain(value) for name, value in gap.items()} for mount, gap in gaps.items()},
        'marks': marks,
        'topics': {
            name: {'type': topic.type, 'messages': topic.message_count}
            for name, topic in recording.topics.items()
        },
        **found.as_json(),
    }
    started, duration = started_of(session, recording), head['duration_s']
    replay = 'replay of ' if 'replay' in session else ''
    driven = f'{replay}{session.get("scenario", "")}, {session.get("mode", "")}'
    shown = ', '.join(f'{name} {made_with[name]}' for name in _VERSIONS if name in made_with)
    here = versions()
    rows = [
        ('started', f'{started:%Y-%m-%d %H:%M:%S}' if started else 'unknown'),
        ('duration', 'unknown' if duration is None else f'{duration:.3f} s'),
        ('session', driven if session else 'none: the recording does not tell what it is'),
        *((f'gap {mount}'.strip(), _gap_text(gap)) for mount, gap in gaps.items()),
        *([('versions', shown)] if made_with else []),
        *([('', versions_sentence(version_differences(session, here), here))] if session else []),
        ('marks', ', '.join(f'{kind}: {count}' for kind, count in marks.items()) or 'none'),
        *((label, text.replace('\n', ' ')) for label, text in found.rows()),
    ]
    parameters = [
        (f'{node}.{name}', _text(value), _text(default))
        for node, own in changed.items()
        for name, (value, default) in own.items()
    ]
    topics = [
        (name, topic.type.replace('/msg/', '/'), str(topic.message_count), _text(audits[name].lost))
        for name, topic in recording.topics.items()
    ]
    tables = [
        Table('Parameters other than the default', 'lll', parameters, ('parameter', 'value', 'default')),
        Table('Topics', 'llrr', topics, ('topic', 'type', 'messages', 'lost')),
    ]
    return Description(figures, rows, [table for table in tables if table.rows])


def _recordings_at(folder: str) -> Iterator[Figures]:
    if is_local(folder):
        yield from map(summarise_recording, _places(local_path(folder)))
        return
    for uri, size in _stored(folder).items():
        verdict = f'{size / 1e6:.1f} MB, not read: engine-mount info fetches it'
        yield {'recording': uri, **_UNKNOWN, 'verdict': verdict, 'sound': None}


def _stored(folder: str) -> dict[str, int]:
    """Return the recordings and runs that a place in a store is or directly holds, with their bytes."""
    root = folder.rstrip('/')
    files = {entry.uri[len(root) :].strip('/'): entry.size for entry in entries(folder)}
    if '' in files:
        return {folder: files['']}
    found: dict[str, int] = {}
    for name, size in files.items():
        first, _, rest = name.partition('/')
        found[first if rest else ''] = found.get(first if rest else '', 0) + size
    recorded = {PurePosixPath(name).parent.as_posix() for name in files if _is_recorded(name)}
    if recorded & {'.', 'recording'}:
        return {folder: sum(files.values())}
    return {
        inside(folder, name): size
        for name, size in sorted(found.items())
        if recorded & {name, f'{name}/recording'}
    }


def _is_recorded(name: str) -> bool:
    return name.endswith('.mcap') or PurePosixPath(name).name == METADATA_NAME


def _places(folder: Path) -> Iterator[Path]:
    """Return the runs and recordings that `folder` is or holds."""
    if _is_recording(folder) or not folder.is_dir():
        yield folder
        return
    yield from sorted(path for path in folder.iterdir() if _is_recording(path))


def _is_recording(path: Path) -> bool:
    if path.is_file():
        return path.suffix == '.mcap'
    places = (path, RunFolder(path).recording)
    return any((place / METADATA_NAME).is_file() or any(place.glob('*.mcap')) for place in places)


def _head(recording: Recording, session: Mapping[str, Any]) -> Figures:
    started = started_of(session, recording)
    return {
        'recording': str(recording.path),
        'started': started.isoformat() if started else None,
        'duration_s': duration_of(session, recording),
    }


def _verdict(path: Path, recording: Recording) -> tuple[str, bool | None]:
    """Return what the summary of the run says, else whether the recording is whole."""
    if not recording.whole:
        return 'not whole', False
    try:
        figures = json.loads(RunFolder(path).summary.read_text(encoding='utf-8'))
    except (OSError, ValueError):
        return 'whole', None
    parts = list(figures.get('mounts', {}).values()) or [figures] if isinstance(figures, dict) else []
    if not any('lost_samples' in part for part in parts):
        return 'whole', None
    counts = {name: sum(_count(part.get(name)) for part in parts) for name in _COUNTS}
    wrong = [f'{_COUNTS[name]}: {count}' for name, count in counts.items() if count]
    return ', '.join(wrong) or 'nothing lost, no faults', not wrong


def _seconds(started: str | None) -> float:
    return datetime.fromisoformat(started).timestamp() if started else 0.0


def _count(value: Any) -> int:
    return len(value) if isinstance(value, list) else value if isinstance(value, int) else 0


def _gaps(recording: Recording) -> dict[str, dict[str, float]]:
    """Return {mount: {name: m}}."""
    found = {}
    for part in recording.by_mount():
        if AIR_GAP.name in part and len(part[AIR_GAP.name]):
            message = part.latched(AIR_GAP.name)
            found[part.mount] = dict(zip(message.name, map(float, message.position), strict=True))
    return found


def _gap_text(gap: Mapping[str, float]) -> str:
    unknown, texts = float('nan'), []
    for name in ('rest', 'contact'):
        value, std = (1e6 * gap.get(key, unknown) for key in (f'{name}_gap', f'{name}_gap_std'))
        texts.append(f'{name} {value:.1f} ± {std:.1f} µm')
    return ', '.join(texts)


def _marks(recording: Recording) -> dict[str, int]:
    parts = [part for part in recording.by_mount() if EVENT.name in part]
    return dict(Counter(mark.kind for part in parts for mark in read_marks(part[EVENT.name])))


def _plain(value: Any) -> Any:
    if value != value:
        return None
    return list(value) if isinstance(value, tuple) else value


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:g}'
    if isinstance(value, (tuple, list)):
        return ', '.join(map(str, value))
    return '' if value is None else str(value)
