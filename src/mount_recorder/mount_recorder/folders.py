"""Folders of further recordings of one run: snapshots, and what a restarted recorder makes."""

from itertools import count, takewhile
from pathlib import Path


def snapshot_folder(first: Path, number: int) -> Path:
    """Return the folder of a snapshot, numbered from 1: `first`, `first`_2, `first`_3, ..."""
    return first if number == 1 else first.with_name(f'{first.name}_{number}')


def saved_snapshots(first: Path) -> list[Path]:
    """Return the folders of the snapshots that a recorder with the folder `first` has saved."""
    folders = (snapshot_folder(first, number) for number in count(1))
    return list(takewhile(Path.exists, folders))


def recordings_of(first: Path) -> list[Path]:
    """Return the recordings of a run: `first`, and one for each time that the recorder was started again."""
    places = (_recording(first, number) for number in count(1))
    return list(takewhile(Path.exists, places))


def next_recording(first: Path) -> Path:
    """Return the folder for the recording behind those there are: `first`_restarted_2, _3, ..."""
    return _recording(first, len(recordings_of(first)) + 1)


def _recording(first: Path, number: int) -> Path:
    return first if number == 1 else first.with_name(f'{first.name}_restarted_{number}')
