"""Where a run puts what it makes: recording, figure, summary, logs."""

import json
from collections.abc import Mapping
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any


class RunFolderError(ValueError):
    """A run's folder cannot be used; the text says why."""


class RunFolder:
    """The folder of one run and the places in it."""

    def __init__(self, path: Path):
        self.path = path
        self.recording = path / 'recording'  # the rosbag2 folder
        self.figure = path / 'drive.png'
        self.report = path / 'report.html'
        self.summary = path / 'summary.json'  # the figures that were printed
        self.logs = path / 'log'  # parameters and output of each node


def new_place(what: str) -> Path:
    """Return `bags/<time>_<what>`, numbered where that exists."""
    name = f'{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}_{what}'
    places = (Path('bags', name if number == 1 else f'{name}_{number}') for number in count(1))
    return next(place for place in places if not place.exists())


def checked_place(place: Path) -> Path:
    """Return a place for a new folder; raises `RunFolderError` for one that holds anything."""
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise RunFolderError(f'{place} exists and is not empty; choose another folder with --out')
    return place


def make_run_folder(wanted: Path | None, scenario: str) -> RunFolder:
    """Create the folder asked for, or `bags/<time>_<scenario>`; one that holds anything is refused."""
    wanted = checked_place(wanted or new_place(scenario))
    folder = RunFolder(wanted)
    try:
        folder.logs.mkdir(parents=True)
    except OSError as error:
        raise RunFolderError(
            f'{wanted} cannot be created: {error.strerror}; choose another with --out'
        ) from None
    return folder


def write_json(figures: Mapping[str, Any], file: Path) -> None:
    """Write `figures`; raises `ValueError` for a number that JSON does not know, and `OSError`."""
    file.write_text(json.dumps(figures, indent=2, allow_nan=False) + '\n', encoding='utf-8')
