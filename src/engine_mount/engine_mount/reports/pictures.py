"""The pictures of a drive and of a comparison: the traces of a report with a detail beside them."""

from dataclasses import replace
from pathlib import Path

from engine_mount.recordings.compare import Comparison
from engine_mount.recordings.difference import by_importance
from engine_mount.recordings.recording import Recording
from engine_mount.reports.drawing.chart import Limits
from engine_mount.reports.drawing.picture import draw_chart
from engine_mount.reports.report import subjects_of
from engine_mount.reports.sections.motion import traces
from engine_mount.reports.sections.subject import Subject

_BEFORE, _AFTER = 0.4, 0.6  # s, chosen: shown in detail round the highest current
_AROUND = 0.2  # s, chosen: shown before and behind the largest difference
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


def draw_comparison(comparison: Comparison, a: Recording, b: Recording, file: Path) -> None:
    """Write displacement and current of `a` and `b` and B - A to `file` (PNG).

    Left the whole time, right around the largest difference of the most important signal; of several mounts
    the one that it belongs to. Raises `ValueError` where neither was recorded.
    """
    important = [signal for signal in by_importance(comparison.signals) if signal.largest or signal.first]
    mount = important[0].mount.strip('/') if important else ''
    if len(a.mounts) > 1:
        mount = mount or a.mounts[0]
        a, b = a.of_mount(mount), b.of_mount(mount)
    subjects = subjects_of([a, b])
    subjects[1].comparison = comparison
    chart = traces(subjects).chart
    if chart is None:
        raise ValueError('neither displacement nor current was recorded: there is nothing to draw')
    views: dict[str, Limits | None] = {'': None}
    if important and (centre := important[0].largest or important[0].first) is not None:
        views[f'around {centre.time:.3f} s'] = (centre.time - _AROUND, centre.time + _AROUND)
    state = f'{mount} ' * bool(a.mount) + ('equal' if comparison.equal else 'different')
    title = f'A {comparison.name_a}, B {comparison.name_b}: {state}'
    draw_chart(replace(chart, title=title), file, views=views)
