"""The page about the result of a fleet, with the worst recordings replayed once more for their pictures."""

import json
import os
from collections.abc import Callable
from pathlib import Path

from engine_mount.fleet.questions import Worst, result_of, worst
from engine_mount.fleet.replay import DISPLACEMENT, signals_of
from engine_mount.reports.fleet.looks import Look
from engine_mount.reports.fleet.report import fleet_report

_BY = {'setpoints': 'setpoint_difference_largest_a', DISPLACEMENT: 'displacement_difference_largest_m'}
"""By which column the worst are chosen, by what a result answers."""


def write_page(
    folder: str | os.PathLike[str],
    file: Path | None = None,
    by: str = '',
    count: int = 10,
    progress: Callable[[float, str], None] = lambda share, recording: None,
) -> tuple[Path, list[Look]]:
    """Write the page about the result in `folder`; return its file and the worst `count` recordings.

    The page is report.html in `folder` unless `file` is named; `by` is the column by which the worst are
    chosen, by default the largest difference. Raises a `ValueError` or `OSError` with the reason.
    """
    result, file = result_of(folder), file or Path(folder) / 'report.html'
    by = by or _BY[result['asked'][0].as_py()]
    looks = []
    for place, one in enumerate(found := worst(folder, by, count)):
        progress(place / len(found), one.row['recording'])
        looks.append(_look(one))
    file.parent.mkdir(parents=True, exist_ok=True)
    fleet_report(result, looks, by, Path(folder).absolute().name).write_page(file)
    return file, looks


def _look(one: Worst) -> Look:
    row = one.row
    try:
        signals = signals_of(one.uri, json.loads(row['changes']), row['mount'], row['asked'] == DISPLACEMENT)
    except (ValueError, OSError) as error:
        return Look(row, one.commands, reason=str(error))
    return Look(row, one.commands, signals)
