"""The recording that a person means: its own folder or file, or the run folder that holds it."""

import hashlib
from pathlib import Path

from engine_mount.recordings.recording import ReadingError, Recording, open_recording

_AT_ONCE = 1 << 20  # bytes, chosen


def open_run(path: Path) -> Recording:
    """Open the recording at `path` or, for the folder of a run, the one in it; raises `ReadingError`."""
    return open_recording(recording_place(path))


def open_mount(path: Path, mount: str = '') -> Recording:
    """Open the recording at `path` for one mount, the only one or `mount`; raises `ReadingError`."""
    recording = open_run(path)
    if not mount and len(recording.mounts) < 2:
        return recording
    if mount.strip('/') not in recording.mounts:
        what = f'no mount {mount!r}' if mount else 'several mounts'
        known = ', '.join(recording.mounts) or 'none with a name'
        raise ReadingError(f'{path} has {what}; it has {known}: choose one with --mount')
    return recording.of_mount(mount.strip('/'))


def recording_place(path: Path) -> Path:
    """Return the recording in `path` if that is the folder of a run, else `path` itself."""
    inside = path / 'recording'
    return inside if inside.is_dir() else path


def recording_hash(path: Path) -> str:
    """Return the SHA-256 of a file; of a folder that of its MCAP files, in the order of their names.

    Of a folder without any it is that of all its files.
    """
    digest = hashlib.sha256()
    files = [part for part in path.rglob('*') if part.is_file()] if path.is_dir() else [path]
    for part in sorted(part for part in files if part.match('*.mcap*')) or sorted(files):
        with part.open('rb') as stream:
            while content := stream.read(_AT_ONCE):
                digest.update(content)
    return digest.hexdigest()
