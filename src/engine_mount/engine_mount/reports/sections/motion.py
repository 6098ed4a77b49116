"""The sections of a report that show how the mount moved."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.recordings.difference import quantity_text
from engine_mount.reports.drawing.chart import (
    DIFFERENCE_COLOUR,
    POINTS,
    Array,
    Chart,
    Curve,
    Panel,
    level_lines,
    look_of,
)
from engine_mount.reports.drive.beside import BesideError, peaks_text
from engine_mount.reports.drive.felt import FIGURES, felt_beside, value_text
from engine_mount.reports.sections.periodic import (
    amplitude_density,
    cycle_work,
    decibels,
    distortion,
    evenly,
    whole_periods,
)
from engine_mount.reports.sections.periodic import (
    harmonics as harmonics_of,
)
from engine_mount.reports.sections.section import Cell, Link, Section, Table
from engine_mount.reports.sections.subject import (
    Signal,
    Subject,
    other_mounts,
    share_road,
    shared_sentences,
)

TIME_LABEL = 'time from the first sample (s)'
BEFORE, AFTER = 0.4, 0.6  # s, chosen: shown first, round the largest displacement or force
_MM = 1e3
_LOOPS = 4  # periods drawn
_PERIODS = 32  # evaluated
_WITHOUT_PERIOD = 0.5  # s, chosen: stretch of a loop where nothing is periodic
_LISTED = 200  # switchings
_LEAST_SAMPLES = 1000  # chosen: of a spectrum
_LEAST_LOST = 0.0005  # share of made-up samples above which a spectrum says so
_HIGHEST = 60.0  # Hz, of a spectrum


def traces(subjects: Sequence[Subject]) -> Section:
    """Return displacement with the levels of its policy above current, over time, as in Fig. 15.

    With the displacement stands that of other mounts on the same road. Where two recordings are compared, the
    second less the first stands below each.
    """
    first, last, several = subjects[0], subjects[-1], len(subjects) > 1
    shaded = next((each for each in subjects if each.shade), first)
    levels: dict[str, float] = next((each.run.levels for each in subjects if each.run.levels), {})
    words = [f'Shaded: the degree of damping in {shaded.name}.'] if several and shaded.shade else []
    if first.run.unknown:
        words.append(f'The levels of the policy are not drawn: {first.run.unknown}.')
    panels: list[Panel] = []
    ends: list[float] = []
    for quantity, what, unit, factor, share, lines, least in (
        ('displacement', 'displacement', 'mm', _MM, 1.5, level_lines(levels), ()),
        ('setpoint', 'current', 'A', 1.0, 1.0, (), (0.0,)),
    ):
        shown = [each for each in subjects if quantity != 'setpoint' or not each.run.without_friction]
        signals = [(each, signal) for each in shown if (signal := each[quantity]) is not None]
        if not signals:
            continue
        ends += [signal.time[place] for _, signal in signals for place in (0, -1)]
        name = first.mount if quantity == 'displacement' and not several else what
        curves = [each.curve(name, signal.time, factor * signal.values) for each, signal in signals]
        curves = [*_others(subjects, quantity, factor), *reversed(curves)]
        panels.append(Panel(f'{what} ({unit})', curves, levels=lines, share=share, least=least))
        if last.comparison is not None and len(signals) > 1:
            panels.append(_difference(f'{what}, B - A ({unit})', signals[0][1], signals[-1][1], factor))
    if not panels:
        return Section('traces', 'Displacement and current', words)
    if others := other_mounts(subjects, 'displacement'):
        words.append(f'Computed on the same road: {", ".join(others)}.')
    if last.comparison is not None:
        words.append(f'B - A: {last.name} less {first.name}.')
    title, limits = 'Displacement and current', (min(ends), max(ends))
    chart = Chart('time_traces', title, TIME_LABEL, panels, shaded.shade, limits)
    moved = {each.name if several else each.mount: each['displacement'] for each in subjects}
    peaks = {name: each.peak() for name, each in {**moved, **others}.items() if each is not None}
    _, at = next(iter(peaks.values()), (0.0, math.nan))
    if share_road(subjects) and math.isfinite(at):
        told = f'Largest displacement: {peaks_text({name: peak for name, (peak, _) in peaks.items()})}'
        words.insert(0, f'{told}. One second round it is shown first.')
        view = max(limits[0], at - BEFORE), min(limits[1], at + AFTER)
        chart = replace(chart, title=told, view=view)
    return Section('traces', title, words, chart)


def switching(subjects: Sequence[Subject]) -> Section:
    """Return when damping was switched, what happened meanwhile, and the marks of the recording."""
    said, tables = [], []
    for subject in subjects:
        spans = subject.damping
        if subject.run.without_friction:
            said.append((subject, f'damping is not applicable: {subject.run.without_friction}'))
        elif spans is None:
            said.append((subject, 'when damping was switched was not recorded'))
        elif not spans:
            said.append((subject, 'damping was never switched on'))
        else:
            more = f' (the first {_LISTED} of {len(spans)})' if len(spans) > _LISTED else ''
            head = ('on (s)', 'off (s)', 'lasted', 'highest displacement', 'highest current')
            rows: list[Sequence[Cell]] = [
                (
                    *(Link(f'{time:.3f}', 'traces', time) for time in (begin, end)),
                    quantity_text(end - begin, 's'),
                    peak_cell(subject['displacement'], 'm', begin, end),
                    peak_cell(subject['setpoint'], 'A', begin, end),
                )
                for begin, end in spans[:_LISTED]
            ]
            tables.append(Table(head, rows, f'{subject.prefix}damping on{more}'))
        if marks := subject.marks:
            rows = [
                (Link(f'{time:.3f}', 'traces', time), mark.kind, mark.text) for time, mark in marks[:_LISTED]
            ]
            tables.append(Table(('time (s)', 'kind', 'text'), rows, f'{subject.prefix}marks'))
    return Section('switching', 'Switching and marks', shared_sentences(subjects, said), None, tables)


def hysteresis(subjects: Sequence[Subject]) -> Section:
    """Return mount force and friction force over displacement, as in Fig. 13 left."""
    groups: dict[str, list[Curve]] = {'mount force': [], 'friction force': []}
    said = []
    event, same_road = _loop_stretch(subjects[0]), share_road(subjects)
    for subject in subjects:
        stretch, how = event if same_road else _loop_stretch(subject)  # on one road the same event
        drawn = False
        for what, curves in groups.items():
            force = None if what == 'friction force' and subject.run.without_friction else subject[what]
            x, y, _ = _together(subject['true displacement'], force, stretch)
            if len(x) > 2:
                name = what if len(subjects) > 1 else subject.mount
                curves.append(subject.curve(name, _MM * x, y))
                drawn = True
        said.append((subject, how if drawn else 'no force was recorded'))
    for force in _others(subjects, 'mount force'):
        moved = other_mounts(subjects, 'displacement')[force.name]
        x, y, _ = _together(moved, Signal(force.x, force.y), event[0])
        groups['mount force'].append(replace(force, x=_MM * x, y=y))
    panels = [Panel(f'{what} (N)', curves[::-1]) for what, curves in groups.items() if curves]
    title = 'Loss hysteresis'
    chart = Chart('hysteresis', title, 'displacement (mm)', panels) if panels else None
    return Section('hysteresis', title, shared_sentences(subjects, said), chart)


def harmonics(subjects: Sequence[Subject]) -> Section:
    """Return harmonics 1 to 8 of the mount force as in Fig. 13 right, its distortion, the work per cycle."""
    said, dots, rows = [], [], []
    for subject in subjects:
        force, steady = subject['mount force'], subject.steady
        if force is None or subject['true displacement'] is None:
            said.append((subject, 'no mount force was recorded'))
            continue
        stretch, sine = steady or (None, None)
        x, y, time = _together(subject['true displacement'], force, stretch)
        if sine is None or len(time) < 2 or (time[-1] - time[0]) * sine.frequency < 3.0:
            said.append((subject, 'the displacement is not one sine for long enough: no harmonics'))
            continue
        inside, periods = whole_periods(time, sine.frequency, _PERIODS)
        amplitudes = harmonics_of(time[inside], y[inside], sine.frequency)
        numbers = np.arange(1.0, len(amplitudes) + 1.0)
        curve = subject.curve('mount force', numbers, decibels(amplitudes))
        dots.append(replace(curve, dash=POINTS))
        rows.append(
            (
                subject.name,
                f'{sine.frequency:.3f}',
                f'{_MM * sine.amplitude:.3f}',
                f'{cycle_work(x[inside], y[inside], periods):.3f}',
                f'{100.0 * distortion(amplitudes):.1f}',
            )
        )
        said.append((subject, f'over the last {periods} periods until {time[inside][-1]:.2f} s'))
    head = (
        'recording', 'frequency (Hz)', 'amplitude (mm)', 'work per cycle (J)', 'distortion (%)',
    )  # fmt: skip
    title, words = 'Harmonics of the mount force', shared_sentences(subjects, said)
    if not rows:
        return Section('harmonics', title, words)
    limits = 0.9, len(dots[0].x) + 0.1
    chart = Chart('harmonics', title, 'harmonic', [Panel('amplitude above 1 N (dB)', dots)], limits=limits)
    return Section('harmonics', title, words, chart, [Table(head, rows)])


def spectra(subjects: Sequence[Subject]) -> Section:
    """Return the amplitude spectral densities of displacement, mount force and chassis acceleration."""
    said, panels = [], []
    for quantity, what, unit, factor in (
        ('displacement', 'displacement', 'mm', _MM),
        ('mount force', 'mount force', 'N', 1.0),
        ('acceleration', 'chassis acceleration', 'm/s²', 1.0),
    ):
        label, curves = f'{what} ({unit}/√Hz)', []
        name = what if len(subjects) > 1 else subjects[0].mount
        signals = [(each, each.curve(name, *signal)) for each in subjects if (signal := each[quantity])]
        signals += [(subjects[0], curve) for curve in _others(subjects, quantity)]
        for subject, curve in signals:
            inside = curve.x >= subject.active_from
            _, values, made_up = evenly(curve.x[inside], curve.y[inside], subject.sample_rate)
            if len(values) < _LEAST_SAMPLES or np.ptp(values) == 0.0:  # too short, or nothing moves
                continue
            if made_up > _LEAST_LOST * len(values):
                share = f'{100.0 * made_up / len(values):.1f} % of the samples of the {what}'
                said.append((subject, f'{share} are missing and were replaced by straight lines'))
            frequency, density = amplitude_density(values, subject.sample_rate)
            shown = (frequency > 0.0) & (frequency <= _HIGHEST)
            curves.append(replace(curve, x=frequency[shown], y=factor * density[shown]))
        if curves:
            panels.append(Panel(label, curves[::-1], log=True))
    words = ['From where control was active; Hann windows of 2.048 s that overlap by half.']
    words += shared_sentences(subjects, said)
    limits = (0.0, _HIGHEST)
    chart = Chart('spectra', 'Spectra', 'frequency (Hz)', panels, limits=limits) if panels else None
    return Section('spectra', 'Spectra', words, chart)


def peak_cell(signal: Signal | None, unit: str, begin: float = -math.inf, end: float = math.inf) -> Cell:
    """Return the highest absolute value between two times (s), with a link to where it is."""
    if signal is None:
        return 'not recorded'
    value, time = signal.peak(begin, end)
    return 'unknown' if math.isnan(value) else Link(quantity_text(value, unit), 'traces', time)


def _others(subjects: Sequence[Subject], quantity: str, factor: float = 1.0) -> list[Curve]:
    """Return the curves of the computed mounts."""
    others = other_mounts(subjects, quantity)
    return [Curve(name, moved.time, factor * moved.values, *look_of(name)) for name, moved in others.items()]


def _difference(label: str, a: Signal, b: Signal, factor: float) -> Panel:
    y = b.values - np.interp(b.time, a.time, a.values, np.nan, np.nan)
    return Panel(label, [Curve('B - A', b.time, factor * y, DIFFERENCE_COLOUR)], share=0.7)


def _loop_stretch(subject: Subject) -> tuple[tuple[float, float] | None, str]:
    """Return the stretch (s) of which loops are drawn, and what it is."""
    if subject.steady is not None:
        (begin, end), sine = subject.steady
        first = max(begin, end - _LOOPS / sine.frequency)
        return (first, end), f'the last periods at {sine.frequency:.2f} Hz, {first:.2f} to {end:.2f} s'
    moved = subject['displacement']
    middle = math.nan if moved is None else moved.peak()[1]
    if math.isnan(middle):
        return None, ''
    begin, end = middle - 0.5 * _WITHOUT_PERIOD, middle + 0.5 * _WITHOUT_PERIOD
    return (begin, end), f'around the largest displacement, {begin:.2f} to {end:.2f} s'


def _together(
    moved: Signal | None, force: Signal | None, stretch: tuple[float, float] | None
) -> tuple[Array, Array, Array]:
    """Return displacement, force and time at the samples of the force within `stretch`, both known."""
    if moved is None or force is None or stretch is None:
        nothing = np.empty(0)
        return nothing, nothing, nothing
    inside = (force.time >= stretch[0]) & (force.time <= stretch[1])
    time, y = force.time[inside], force.values[inside]
    known = np.isfinite(moved.values)
    x = np.interp(time, moved.time[known], moved.values[known]) if known.any() else np.full(len(time), np.nan)
    both = np.isfinite(x) & np.isfinite(y)
    return x[both], y[both], time[both]


def felt(subjects: Sequence[Subject]) -> Section:
    """Return what chassis and people feel by frequency, and what it costs, of all mounts on the same road."""
    said, tables = [], []
    for subject in subjects:
        try:
            mounts = felt_beside(subject.recording, subject.run.parameters, subject.beside)
        except BesideError as reason:
            said.append((subject, f'not measured: {reason}'))
            continue
        rows = [
            (what, *(value_text(key, each[key]) for each in mounts.values())) for key, what in FIGURES.items()
        ]
        tables.append(Table(('', *mounts), rows, subject.prefix.removesuffix(': ')))
    words = (
        ['Rms from the begin of the excitation on; vertical acceleration of the chassis.'] if tables else []
    )
    return Section('felt', 'By frequency', words + shared_sentences(subjects, said), None, tables)


def draw_drive(subject: Subject, *files: Path) -> None:
    """Write the picture of a drive to `files` (PNG, SVG); raises `ValueError` without any signal."""
    from engine_mount.reports.drawing.picture import draw_chart  # what draws takes a second to load

    if (chart := traces([subject]).chart) is None:
        raise ValueError('neither displacement nor current was recorded')
    draw_chart(chart, *files)
