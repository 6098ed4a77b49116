"""The pictures of a drive and of a comparison."""

from dataclasses import replace
from pathlib import Path

from engine_mount.recordings.compare import Comparison, matched_topics
from engine_mount.recordings.difference import SignalDifference, by_importance
from engine_mount.recordings.recording import Recording
from engine_mount.reports.drawing.chart import DASHED, Chart, Curve, Limits, Panel
from engine_mount.reports.drawing.picture import draw_chart
from engine_mount.reports.drawing.style import COLOURS, DIFFERENCE_COLOUR
from engine_mount.reports.sections.motion import traces
from engine_mount.reports.sections.subject import Subject
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT

_SIGNALS = 3  # drawn of a comparison
_LEAST_SAMPLES = 10  # chosen: less is no curve
_AROUND = 0.2  # s, chosen: shown before and behind the largest difference
_ALWAYS = (f'{CURRENT_SETPOINT.name}.coil_current', f'{DISPLACEMENT.name}.mount')
_BEFORE, _AFTER = 0.4, 0.6  # s, chosen: shown in detail round the highest current
_SHORTEST = 1.0  # s, chosen: a drive that never reached its excitation is shown from its end


def draw_drive(subject: Subject, begin: float, title: str, *files: Path) -> None:
    """Write the picture of a drive from `begin` (s) on to `files` (PNG, SVG), in the manner of Fig. 15.

    Right, where there is a current, its highest moment in detail.
    """
    chart, setpoint = traces([subject]).chart, subject['setpoint']
    if chart is None or chart.limits is None:
        raise ValueError('no displacement was recorded')
    end = chart.limits[1]
    views = {'': (min(begin, end - _SHORTEST), end)}
    strongest, at = (0.0, 0.0) if setpoint is None else setpoint.peak(begin)
    if strongest > 0.0:
        views['where the current is highest'] = (at - _BEFORE, at + _AFTER)
    draw_chart(replace(chart, title=title), *files, views=views)


def draw_comparison(comparison: Comparison, a: Recording, b: Recording, file: Path) -> None:
    """Write the picture of `comparison` of `a` and `b` to `file` (PNG).

    Left the whole time, right around the largest difference of the most important signal; below each signal
    B - A. Of equal recordings current and displacement are shown.
    """
    signals = _chosen(comparison)
    topics = {(topic.mount, topic.topic): topic for topic in matched_topics(a, b, comparison.alignments)}
    panels = []
    for signal in signals:
        column = topics[signal.mount, signal.topic].column(signal.signal)
        factor, unit = (1e3, 'mm') if signal.unit == 'm' else (1.0, signal.unit)
        label = f'{signal.mount}{signal.topic}\n{signal.signal}' + (f' ({unit})' if unit else '')
        curves = [
            Curve('A', column.time, factor * column.a, COLOURS[0]),
            Curve('B', column.time, factor * column.b, COLOURS[1], DASHED),
        ]
        difference = Curve('B - A', column.time, factor * (column.b - column.a), DIFFERENCE_COLOUR)
        panels += [Panel(label, curves), Panel('B - A', [difference], share=0.4)]
    views: dict[str, Limits | None] = {'': None}
    centre = next((moment for each in signals if (moment := each.largest or each.first)), None)
    if centre is not None:
        views[f'around {centre.time:.3f} s'] = (centre.time - _AROUND, centre.time + _AROUND)
    state = 'equal' if comparison.equal else 'different'
    title = f'A {comparison.name_a}, B {comparison.name_b}: {state}'
    draw_chart(Chart('comparison', title, 'time from the first sample of A (s)', panels), file, views=views)


def _chosen(comparison: Comparison) -> list[SignalDifference]:
    known = [signal for signal in comparison.signals if signal.samples >= _LEAST_SAMPLES]
    # The same quantity a second time, such as the setpoint in the control trace, is left out.
    differing = {(each.mount, each.unit, each.largest): each for each in reversed(by_importance(known))}
    if differing:
        return by_importance(differing.values())[:_SIGNALS]
    return [each for each in known if f'{each.topic}.{each.signal}' in _ALWAYS] or known[:1]
