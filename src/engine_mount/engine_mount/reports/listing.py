"""What recordings are, from what stands at the ends of their files: no message but the session is read."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any

from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.session import duration_of, session_parameters, started_of, told_session
from engine_mount.settings.run_folder import RunFolder
from engine_mount.signals.sources.stores import entries
from engine_mount.signals.sources.uris import inside, is_local, local_path
from mount_recorder.metadata import METADATA_NAME
from mount_sim.mount_choice import simulated_mounts

_SOUND = 'nothing lost, no faults'
_COUNTS = {
    'lost_samples': 'samples lost',
    'lost_messages': 'messages lost',
    'unanswered_samples': 'samples unanswered',
    'misdated_messages': 'messages misdated',
    'faults': 'faults',
    'restarts': 'nodes started again',
}


@dataclass(frozen=True)
class Listed:
    """One recording; `started` with its zone, `duration` in s of its stamps, empty or None where unknown.

    `path` is its URI where it lies in a store. `sound` is None where no summary of a run tells whether
    anything was lost or went wrong.
    """

    path: Path | str
    started: datetime | None = None
    duration: float | None = None
    scenario: str = ''
    mode: str = ''
    mount: str = ''
    policy: str = ''
    verdict: str = ''
    sound: bool | None = None

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON knows it: unknown is null."""
        return {
            'recording': str(self.path),
            'started': self.started.isoformat() if self.started else None,
            'duration_s': self.duration,
            **{name: getattr(self, name) or None for name in ('scenario', 'mode', 'mount', 'policy')},
            'verdict': self.verdict,
            'sound': self.sound,
        }


def listed(folders: Sequence[Path | str]) -> list[Listed]:
    """Return the recordings in `folders`, and those that these are themselves, the newest first.

    A folder is a path or a URI; in a store only names and sizes are read. Raises `SourceError` where a store
    cannot be listed.
    """
    found = [one for folder in folders for one in _listed_at(str(folder))]
    return sorted(found, key=lambda one: one.started.timestamp() if one.started else 0.0, reverse=True)


def listed_one(path: Path) -> Listed:
    """Return what is known of the run or recording at `path`, as its verdict where it cannot be read."""
    try:
        recording = open_run(path)
        content = told_session(recording)
    except (ReadingError, OSError) as error:
        return Listed(path, verdict=str(error), sound=False)
    parameters = session_parameters(content)
    verdict, sound = _verdict(path, recording)
    return Listed(
        path,
        started_of(content, recording),
        duration_of(content, recording),
        _scenario(content),
        str(content.get('mode', '')),
        simulated_mounts(parameters),
        str(parameters.get('mount_control', {}).get('policy', '')),
        verdict,
        sound,
    )


def _listed_at(folder: str) -> Iterator[Listed]:
    if is_local(folder):
        yield from map(listed_one, _places(local_path(folder)))
        return
    for uri, size in _stored(folder).items():
        yield Listed(uri, verdict=f'{size / 1e6:.1f} MB, not read: engine-mount info fetches it')


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
    if _is_one(folder) or not folder.is_dir():
        yield folder
        return
    yield from sorted(path for path in folder.iterdir() if _is_one(path))


def _is_one(path: Path) -> bool:
    inside = RunFolder(path).recording
    if path.is_file():
        return path.suffix == '.mcap'
    return any((place / METADATA_NAME).is_file() or any(place.glob('*.mcap')) for place in (path, inside))


def _scenario(content: Mapping[str, Any]) -> str:
    scenario = str(content.get('scenario', ''))
    return f'replay of {scenario}'.strip() if 'replay' in content else scenario


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
    return ', '.join(wrong) or _SOUND, not wrong


def _count(value: Any) -> int:
    return len(value) if isinstance(value, list) else value if isinstance(value, int) else 0
