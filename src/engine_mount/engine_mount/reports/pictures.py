"""The picture of a drive: the traces of a report with a detail beside them."""

from dataclasses import replace
from pathlib import Path

from engine_mount.reports.drawing.chart import Limits
from engine_mount.reports.drawing.picture import draw_chart
from engine_mount.reports.sections.motion import traces
from engine_mount.reports.sections.subject import Subject

_BEFORE, _AFTER = 0.4, 0.6  # s, chosen: shown in detail round the highest current
_SHORTEST = 1.0  # s, chosen: a drive that never reached its excitation is shown from its end


def draw_drive(subject: Subject, begin: float, title: str, *files: Path) -> None:
    """Write the picture of a drive from `begin` (s) on to `files` (PNG, SVG), in the manner of Fig. 15.

    Right, where there is a current, its highest moment in detail. Raises `ValueError` without any signal.
    """
    chart, setpoint = traces([subject]).chart, subject['setpoint']
    if chart is None or chart.limits is None:
        raise ValueError('neither displacement nor current was recorded')
    end = chart.limits[1]
    views: dict[str, Limits | None] = {'': (min(begin, end - _SHORTEST), end)}
    strongest, at = (0.0, 0.0) if setpoint is None else setpoint.peak(begin)
    if strongest > 0.0:
        views['where the current is highest'] = (at - _BEFORE, at + _AFTER)
    draw_chart(replace(chart, title=title), *files, views=views)
