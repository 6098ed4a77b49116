"""What the recording of a graph under test has lost."""

from functools import lru_cache
from pathlib import Path

import numpy as np

import engine_mount
from engine_mount.recordings import ReadingError
from mount_models.sampling import SAMPLE_TIME_NS

_SLACK = 1.0  # s: from the stamp of a sample to the log time of its neighbour


def lost_while(folder: Path, begin: float, end: float) -> list[str]:
    """Return a sentence if a recording in `folder` lacks samples of `sim/truth` between two system times, s.

    The simulator numbers its samples without a gap, whatever happens to the graph, so each hole is a loss.
    """
    found = [hole for hole in _holes(folder) if begin - _SLACK <= hole[0] <= end + _SLACK]
    unreadable = [place.name for place in _recordings(folder) if _truth(place) is None]
    said = [f'{name} cannot be read' for name in unreadable]
    if found:
        said.append(f'{sum(count for _, count in found)} samples of sim/truth are not in the recording')
    return said


@lru_cache(maxsize=4)
def _holes(folder: Path) -> tuple[tuple[float, int], ...]:
    """Return (system time s, missing samples) of each hole."""
    holes = []
    for place in _recordings(folder):
        stamps = _truth(place)
        if stamps is None or len(stamps) == 0:
            continue
        steps = np.rint(np.diff(stamps) / SAMPLE_TIME_NS).astype(int)
        holes += [(1e-9 * float(stamps[k]), int(steps[k]) - 1) for k in np.flatnonzero(steps > 1)]
    return tuple(holes)


def _recordings(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob('recording*') if path.is_dir())


@lru_cache(maxsize=4)
def _truth(place: Path) -> np.ndarray | None:
    """Return the stamps (ns) of `sim/truth`; None where nothing can be read."""
    try:
        recording = engine_mount.open(place)
        return recording['sim/truth'].stamps if 'sim/truth' in recording else np.empty(0, np.int64)
    except (ReadingError, KeyError):
        return None
