"""Folders of the recordings of one run: a restarted recorder makes a further one."""

from itertools import count, takewhile
from pathlib import Path


def recordings_of(first: Path) -> list[Path]:
    """Return the recordings of a run: `first`, and one for each time that the recorder was started again."""
    return list(takewhile(Path.exists, (_recording(first, number) for number in count(1))))


def next_recording(first: Path) -> Path:
    """Return the folder for the recording behind those there are: `first`_restarted_2, _3, ..."""
    return _recording(first, len(recordings_of(first)) + 1)


def _recording(first: Path, number: int) -> Path:
    return first if number == 1 else first.with_name(f'{first.name}_restarted_{number}')
