"""The charts of a report, each from plain arrays in SI units; several series of one kind share a chart.

They take arrays, so no recording is needed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle

import numpy as np

from engine_mount.reports.drawing.chart import (
    DASHED,
    DOTTED,
    SOLID,
    Array,
    Chart,
    Curve,
    Dots,
    Level,
    Panel,
    Span,
)
from engine_mount.reports.drawing.style import COLOUR_OF, COLOURS, DIFFERENCE_COLOUR, UNDAMPED_COLOUR

_MM = 1e3
TIME_LABEL = 'time from the first sample (s)'


@dataclass(frozen=True)
class Named:
    """A series of numbers `y` over `x` with the name that the legend gives it; empty: only one is drawn.

    `colour` is that of a thing with a colour of its own, empty: that of its place among the others.
    """

    name: str
    x: Array
    y: Array
    colour: str = ''


@dataclass(frozen=True)
class Levels:
    """Levels of displacement (m) by their labels, and limit of the current (A), None: not known."""

    displacement: Mapping[str, float] = field(default_factory=dict)
    current_limit: float | None = None


def time_traces(
    displacements: Sequence[Named],
    currents: Sequence[Named],
    levels: Levels,
    damping: Sequence[tuple[float, float]] = (),
    title: str = 'Displacement and current',
    name: str = 'time_traces',
    limits: tuple[float, float] | None = None,
    undamped: Named | None = None,
    differ: bool = False,
) -> Chart:
    """Return displacement (m) with the levels of its policy above current (A), over time (s), as in Fig. 15.

    `damping` are the stretches in which damping is on; `undamped` is the displacement of the same mount
    without current. Where two series `differ`, the second less the first stands below each pair.
    """
    panels = []
    if displacements:
        curves = [_curve(series, place, 'displacement', _MM) for place, series in enumerate(displacements)]
        if undamped is not None:
            grey = Curve('undamped', undamped.x, _MM * undamped.y, UNDAMPED_COLOUR)
            curves.insert(0, grey)  # below the others
        panels.append(Panel('displacement (mm)', curves, levels=_lines(levels), share=1.5))
        panels += _difference(displacements, 'displacement, B - A (mm)', _MM) if differ else []
    if currents:
        panels.append(
            Panel('current (A)', [_curve(series, place, 'current') for place, series in enumerate(currents)])
        )
        panels += _difference(currents, 'current, B - A (A)') if differ else []
    return Chart(name, title, TIME_LABEL, panels, _spans(damping), 'damping on', limits)


def _difference(series: Sequence[Named], label: str, factor: float = 1.0) -> list[Panel]:
    """Return the panel of the last series less the first one, where both are known."""
    if len(series) < 2:
        return []
    first, other = series[0], series[-1]
    y = other.y - np.interp(other.x, first.x, first.y, np.nan, np.nan)
    return [Panel(label, [Curve('B - A', other.x, (factor * y), DIFFERENCE_COLOUR)], share=0.7)]


def hysteresis_loops(
    mount_forces: Sequence[Named],
    friction_forces: Sequence[Named],
    title: str = 'Loss hysteresis',
    name: str = 'hysteresis',
) -> Chart:
    """Return mount force and friction force (N) over displacement (m), as in Fig. 13 left."""
    panels = [
        Panel(label, [_curve(series, place, short, x_factor=_MM) for place, series in enumerate(group)])
        for label, short, group in (
            ('mount force (N)', 'mount force', mount_forces),
            ('friction force (N)', 'friction force', friction_forces),
        )
        if group
    ]
    return Chart(name, title, 'displacement (mm)', panels)


def harmonics_dots(
    amplitudes: Sequence[Named],
    title: str = 'Harmonics of the mount force',
    name: str = 'harmonics',
) -> Chart:
    """Return the amplitudes (N) of harmonics (their numbers as x) in dB above 1 N, as in Fig. 13 right."""
    dots = [
        Dots(each.name or 'mount force', each.x, decibels(each.y), each.colour or COLOURS[place])
        for place, each in enumerate(amplitudes)
    ]
    ticks = tuple(max((each.x for each in amplitudes), key=len).tolist())
    return Chart(name, title, 'harmonic', [Panel('amplitude above 1 N (dB)', dots=dots)], ticks=ticks)


def decibels(amplitudes: Array) -> Array:
    """Return 20 log10 of `amplitudes`, NaN where one is 0."""
    known = np.where(np.asarray(amplitudes) > 0.0, amplitudes, np.nan)
    return np.asarray(20.0 * np.log10(known))


def spectra(
    groups: Sequence[tuple[str, Sequence[Named]]],
    highest: float = 60.0,
    title: str = 'Spectra',
    name: str = 'spectra',
) -> Chart:
    """Return amplitude spectral densities over frequency (Hz); each group is a panel with its own label."""
    panels = [
        Panel(
            label,
            [_curve(_within(series, highest), place, label) for place, series in enumerate(group)],
            log=True,
        )
        for label, group in groups
    ]
    return Chart(name, title, 'frequency (Hz)', panels, limits=(0.0, highest))


def sweep_bands(
    peaks: Sequence[Named],
    accelerations: Sequence[Named] = (),
    levels: Levels | None = None,
    title: str = 'Sweep',
    name: str = 'sweep',
) -> Chart:
    """Return the peak displacement (m) of each band of frequency (Hz), below it the rms acceleration (m/s^2).

    The x of a series are the lower edges of its bands; as in Fig. 14, both
    logarithmic.
    """
    panels = [
        Panel(
            'peak displacement (mm)',
            [
                _curve(_held(series), place, 'displacement', _MM, steps=True)
                for place, series in enumerate(peaks)
            ],
            levels=_lines(levels or Levels(), both=False),
            log=True,
        )
    ]
    if accelerations:
        panels.append(
            Panel(
                'chassis acceleration,\nrms (m/s²)',
                [
                    _curve(_held(series), place, 'acceleration', steps=True)
                    for place, series in enumerate(accelerations)
                ],
                log=True,
            )
        )
    return Chart(name, title, 'frequency of the excitation (Hz)', panels)


def tracking(
    wanted: Sequence[Named],
    actual: Sequence[Named],
    damping: Sequence[tuple[float, float]] = (),
    limits: tuple[float, float] | None = None,
    title: str = 'Friction force against the wanted one',
    name: str = 'tracking',
) -> Chart:
    """Return wanted and true friction force (N) over time (s), and their difference."""
    forces = [_curve(series, place, 'true') for place, series in enumerate(actual)]
    forces += [
        Curve(f'wanted{_of(series)}', series.x, series.y, _wanted_colour(place), DASHED)
        for place, series in enumerate(wanted)
    ]
    errors = [
        _curve(Named(one.name, other.x, (other.y - np.interp(other.x, one.x, one.y))), place, 'error')
        for place, (one, other) in enumerate(zip(wanted, actual, strict=True))
    ]
    panels = [Panel('friction force (N)', forces, share=1.6), Panel('true minus wanted (N)', errors)]
    return Chart(name, title, TIME_LABEL, panels, _spans(damping), 'damping on', view=limits)


def _wanted_colour(place: int) -> str:
    return COLOUR_OF['desired_force'] if place == 0 else COLOURS[(place + 1) % len(COLOURS)]


def plain_traces(
    groups: Sequence[tuple[str, Sequence[Named]]], title: str = 'Recorded signals', name: str = 'signals'
) -> Chart:
    """Return any signals over time (s), each group with its label in a panel of its own."""
    panels = [
        Panel(label, [_curve(series, place, label) for place, series in enumerate(group)])
        for label, group in groups
    ]
    return Chart(name, title, TIME_LABEL, panels)


def _curve(
    series: Named,
    place: int,
    what: str,
    factor: float = 1.0,
    x_factor: float = 1.0,
    steps: bool = False,
) -> Curve:
    colour = series.colour or COLOURS[place % len(COLOURS)]
    x, y = _scaled(x_factor, series.x), _scaled(factor, series.y)
    return Curve(f'{what}{_of(series)}', x, y, colour, SOLID, steps)


def _scaled(factor: float, values: Array) -> Array:
    return values if factor == 1.0 else (factor * values)


def _of(series: Named) -> str:
    return f', {series.name}' if series.name else ''


def _lines(levels: Levels, both: bool = True) -> list[Level]:
    """Return the levels as lines, by turns dashed and dotted; `both`: to either side of zero."""
    return [
        Level(f'{name}, {_MM * value:g} mm', _MM * value, dash, both)
        for (name, value), dash in zip(levels.displacement.items(), cycle((DASHED, DOTTED)), strict=False)
    ]


def _spans(stretches: Sequence[tuple[float, float]]) -> list[Span]:
    return [Span(begin, end) for begin, end in stretches]


def _within(series: Named, highest: float) -> Named:
    shown = (series.x > 0.0) & (series.x <= highest)
    return replace(series, x=series.x[shown], y=series.y[shown])


def _held(series: Named) -> Named:
    """Return the series with the end of its last band, so that steps show all of it."""
    width = float(np.min(np.diff(series.x))) if len(series.x) > 1 else 1.0
    return replace(series, x=np.append(series.x, series.x[-1] + width), y=np.append(series.y, series.y[-1]))
