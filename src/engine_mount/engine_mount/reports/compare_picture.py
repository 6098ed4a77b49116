"""The picture of a comparison: the most important signals of both, and their difference."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

from matplotlib.figure import Figure
from numpy.typing import NDArray

from engine_mount.recordings.compare import Comparison, matched_topics
from engine_mount.recordings.difference import Column, SignalDifference, by_importance
from engine_mount.recordings.recording import Recording
from engine_mount.reports.drawing.style import COLOURS, DIFFERENCE_COLOUR
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT

_SIGNALS = 3  # drawn
_LEAST_SAMPLES = 10  # chosen: less is no curve
_AROUND = 0.2  # s, chosen: shown before and behind the largest difference
_HANDY = {'m': (1e3, 'mm')}
_ALWAYS = (f'{CURRENT_SETPOINT.name}.coil_current', f'{DISPLACEMENT.name}.mount')


def draw_comparison(comparison: Comparison, a: Recording, b: Recording, file: Path) -> None:
    """Write the picture of `comparison` of `a` and `b` to `file` (PNG).

    Left the whole time, right around the largest difference; below each signal B - A. Of equal recordings
    current and displacement are shown.
    """
    signals = _chosen(comparison)
    columns = _columns(comparison, a, b, signals)
    picture = Figure(figsize=(12.0, 1.0 + 3.2 * len(columns)), layout='constrained')
    detailed = any(signal.first is not None for signal, _ in columns)
    rows = picture.subplots(
        2 * len(columns),
        1 + detailed,
        height_ratios=(5, 2) * len(columns),
        width_ratios=(3, 2)[: 1 + detailed],
        squeeze=False,
    )
    for place, (signal, column) in enumerate(columns):
        _draw(rows[2 * place : 2 * place + 2], signal, column)
    for axes in rows[-1]:
        axes.set_xlabel('time from the first sample of A (s)')
    handles, labels = rows[0, 0].get_legend_handles_labels()
    picture.legend(handles, labels, loc='outside lower center', ncols=3, fontsize='small')
    state = 'equal' if comparison.equal else 'different'
    picture.suptitle(f'A {comparison.name_a}, B {comparison.name_b}: {state}')
    picture.savefig(file, dpi=100)


def _chosen(comparison: Comparison) -> list[SignalDifference]:
    drawable = [signal for signal in by_importance(comparison.signals) if signal.samples >= _LEAST_SAMPLES]
    if drawable:
        return _distinct(drawable)[:_SIGNALS]
    known = [signal for signal in comparison.signals if signal.samples >= _LEAST_SAMPLES]
    return [signal for signal in known if f'{signal.topic}.{signal.signal}' in _ALWAYS] or known[:1]


def _distinct(signals: list[SignalDifference]) -> list[SignalDifference]:
    """Leave out what is the same quantity a second time, such as the setpoint in the control trace."""
    seen, chosen = set(), []
    for signal in signals:
        key = (signal.mount, signal.unit, signal.largest)
        if key not in seen:
            seen.add(key)
            chosen.append(signal)
    return chosen


def _columns(
    comparison: Comparison, a: Recording, b: Recording, signals: list[SignalDifference]
) -> list[tuple[SignalDifference, Column]]:
    topics = {(topic.mount, topic.topic): topic for topic in matched_topics(a, b, comparison.alignments)}
    return [(signal, topics[signal.mount, signal.topic].column(signal.signal)) for signal in signals]


def _draw(axes: NDArray[Any], signal: SignalDifference, column: Column) -> None:
    factor, unit = _HANDY.get(signal.unit, (1.0, signal.unit))
    named = f'{signal.mount}{signal.topic}\n{signal.signal}' + (f' ({unit})' if unit else '')
    centre = signal.largest or signal.first
    for place, (upper, lower) in enumerate(axes.T):
        shown = slice(None)
        if place and centre is not None:
            shown = abs(column.time - centre.time) <= _AROUND
            upper.set_title(f'around {centre.time:.3f} s', fontsize='small')
        time = column.time[shown]
        upper.plot(time, factor * column.a[shown], color=COLOURS[0], linewidth=1.0, label='A')
        upper.plot(time, factor * column.b[shown], color=COLOURS[1], linewidth=1.0, linestyle='--', label='B')
        lower.plot(
            time,
            factor * (column.b[shown] - column.a[shown]),
            color=DIFFERENCE_COLOUR,
            linewidth=0.8,
            label='B - A',
        )
        lower.sharex(upper)
        upper.tick_params(labelbottom=False)
        for each in (upper, lower):
            each.grid(alpha=0.25)
    axes[0, 0].set_ylabel(named, fontsize='small')
    axes[1, 0].set_ylabel('B - A', fontsize='small')
