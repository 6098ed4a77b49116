"""Where a run puts what it makes: recording, figure, summary, logs."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path


class RunFolderError(ValueError):
    """A run's folder cannot be used; the text says why."""


@dataclass(frozen=True)
class RunFolder:
    """The folder of one run and the places in it."""

    path: Path

    @property
    def recording(self) -> Path:
        """The rosbag2 folder."""
        return self.path / 'recording'

    @property
    def figure(self) -> Path:
        """The picture of the drive."""
        return self.path / 'drive.png'

    @property
    def report(self) -> Path:
        """The page about the run."""
        return self.path / 'report.html'

    @property
    def summary(self) -> Path:
        """The figures that were printed, as JSON."""
        return self.path / 'summary.json'

    @property
    def logs(self) -> Path:
        """Parameters and output of each node."""
        return self.path / 'log'


def new_place(what: str) -> Path:
    """Return `bags/<time>_<what>`, numbered where that exists."""
    name = f'{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}_{what}'
    wanted = Path('bags') / name
    number = 2
    while wanted.exists():
        wanted, number = Path('bags') / f'{name}_{number}', number + 1
    return wanted


def make_run_folder(wanted: Path | None, scenario: str) -> RunFolder:
    """Create the folder asked for, or `bags/<time>_<scenario>`; one that holds anything is refused."""
    if wanted is None:
        wanted = new_place(scenario)
    if wanted.exists() and (not wanted.is_dir() or any(wanted.iterdir())):
        raise RunFolderError(f'{wanted} exists and is not empty; choose another folder with --out')
    folder = RunFolder(wanted)
    try:
        folder.logs.mkdir(parents=True)
    except OSError as error:
        raise RunFolderError(
            f'{wanted} cannot be created: {error.strerror}; choose another with --out'
        ) from None
    return folder
