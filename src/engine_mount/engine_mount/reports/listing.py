"""Which recordings there are, from the ends of their files, and what one of them is and holds."""

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_mount.recordings.access import audit
from engine_mount.recordings.events import read_marks
from engine_mount.recordings.recording import ReadingError, Recording, open_run
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
from engine_mount.settings.chosen import changed_parameters
from engine_mount.settings.run_folder import RunFolder
from engine_mount.signals.formats.measured import Measured
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
    notes: Sequence[str]


def list_recordings(folders: Sequence[Path]) -> list[Figures]:
    """Return the recordings in `folders`, and those that these are themselves, the newest first.

    `sound` is None where no summary of a run says whether anything was lost or went wrong.
    """

    def seconds(one: Figures) -> float:
        return datetime.fromisoformat(one['started']).timestamp() if one['started'] else 0.0

    found = [summarise_recording(path) for folder in folders for path in _places(folder)]
    return sorted(found, key=seconds, reverse=True)


def summarise_recording(path: Path) -> Figures:
    """Return what is known of the run or recording at `path`, as its verdict where it cannot be read."""
    try:
        recording = open_run(path)
        session = told_session(recording)
    except (ReadingError, OSError) as error:
        return {'recording': str(path), **_UNKNOWN, 'verdict': str(error), 'sound': False}
    parameters = session_parameters(session)
    verdict, sound = _verdict(path, recording)
    return {
        **_head(recording, session),
        'recording': str(path),
        'scenario': _scenario(session) or None,
        'mode': str(session.get('mode', '')) or None,
        'mount': simulated_mounts(parameters) or None,
        'policy': str(parameters.get('mount_control', {}).get('policy', '')) or None,
        'verdict': verdict,
        'sound': sound,
    }


def describe_recording(recording: Recording) -> Description:
    """Return what a recording is and holds; every message is looked at, for the losses."""
    session = told_session(recording)
    audited = audit(recording)
    found = audited.losses
    head, made_with = _head(recording, session), versions_told(session)
    changed = changed_parameters(session_parameters(session))
    gaps: dict[str, dict[str, float]] = {}  # {mount: {name: m}}
    marks: Counter[str] = Counter()
    for part in recording.by_mount():
        if AIR_GAP.name in part and len(part[AIR_GAP.name]):
            message = part.latched(AIR_GAP.name)
            gaps[part.mount] = dict(zip(message.name, map(float, message.position), strict=True))
        if EVENT.name in part:
            marks.update(mark.kind for mark in read_marks(part[EVENT.name]))
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
    driven = f'{_scenario(session)}, {session.get("mode", "")}'
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
        (name, topic.type.replace('/msg/', '/'), str(topic.message_count), _text(audited.topics[name].lost))
        for name, topic in recording.topics.items()
    ]
    tables = [
        Table('Parameters other than the default', 'lll', parameters, ('parameter', 'value', 'default')),
        Table('Topics', 'llrr', topics, ('topic', 'type', 'messages', 'lost')),
    ]
    return Description(figures, rows, [table for table in tables if table.rows], recording.warnings)


def describe_measured(measured: Measured) -> Description:
    """Return the columns of a foreign file in numbers: values in the file's own unit, rate in Hz, span in s.

    None where a number is not known, as rate and span where a column holds the times.
    """
    origin, columns, texts = measured.provenance, [], []
    for column in measured.columns.values():
        known = column.values[~np.isnan(column.values)]
        sizes = (known.min, known.mean, known.max)
        least, mean, greatest = (float(size()) if known.size else None for size in sizes)
        times = np.zeros(0) if column.time is None else column.time.times
        span = float(times[-1] - times[0]) if len(times) > 1 else None
        rate = (len(times) - 1) / span if span else None
        count = column.values.size
        columns.append({
            'name': column.name, 'unit': column.unit, 'samples': count, 'missing': count - known.size,
            'least': least, 'mean': mean, 'greatest': greatest, 'rate': rate, 'span': span,
        })  # fmt: skip
        texts.append((
            column.name, column.unit, str(count),
            '' if rate is None else f'{rate:.6g} Hz',
            '' if span is None else f'{span:.6g} s',
            'none' if mean is None else f'{least:.4g} .. {greatest:.4g}',
            '' if mean is None else f'{mean:.4g}',
        ))  # fmt: skip
    read_by = f'{origin.uri}, {origin.format}, read by {origin.reader}'
    heads = ('column', 'unit', 'samples', 'rate', 'span', 'range', 'mean')
    return Description(
        {'provenance': origin._asdict(), 'columns': columns, 'notes': measured.notes},
        [('file', read_by), ('SHA-256', origin.sha256)],
        [Table('Columns', 'llrrrrr', texts, heads)],
        measured.notes,
    )


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


def _scenario(session: Mapping[str, Any]) -> str:
    scenario = str(session.get('scenario', ''))
    return f'replay of {scenario}'.strip() if 'replay' in session else scenario


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


def _count(value: Any) -> int:
    return len(value) if isinstance(value, list) else value if isinstance(value, int) else 0


def _gap_text(gap: Mapping[str, float]) -> str:
    def microns(name: str) -> str:
        return f'{1e6 * gap.get(name, math.nan):.1f}'

    return ', '.join(
        f'{name} {microns(f"{name}_gap")} ± {microns(f"{name}_gap_std")} µm' for name in ('rest', 'contact')
    )


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
