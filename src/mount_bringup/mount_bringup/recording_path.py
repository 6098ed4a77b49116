"""The recording that a person means: its own folder or file, or the run folder that holds it."""

from pathlib import Path

from mount_bags.reading import Recording, open_recording


def open_run(path: Path) -> Recording:
    """Open the recording at `path` or, for the folder of a run, the one in it; raises `ReadingError`."""
    inside = path / 'recording'
    return open_recording(inside if inside.is_dir() else path)
