"""The sections of a report that show how the mount moved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from engine_mount.recordings.difference import quantity_text
from engine_mount.reports.drawing.chart import Array
from engine_mount.reports.sections import charts, periodic
from engine_mount.reports.sections.charts import Levels, Named
from engine_mount.reports.sections.periodic import Sine, cycle_work, distortion, whole_periods
from engine_mount.reports.sections.section import Cell, Link, Section, Table
from engine_mount.reports.sections.spectrum import amplitude_density, evenly
from engine_mount.reports.sections.subject import Subject
from engine_mount.reports.sections.sweep import peak_per_band, rms_per_band
from engine_mount.reports.sections.wording import Sentences
from engine_mount.reports.signals import Signal

OfSubject = Callable[[Subject], Signal | None]

_LOOPS = 4  # periods drawn
_PERIODS = 32  # evaluated
_WITHOUT_PERIOD = 0.5  # s, chosen: stretch of a loop where nothing is periodic
_FOREIGN = 6  # signals drawn of a recording that is not of this project
_TOLD = 200  # switchings listed
_LABEL = 24  # letters
_AROUND = 0.5  # s, chosen: shown to either side of what a number links to
_LEAST_SAMPLES = 1000  # chosen: of a spectrum
_LEAST_LOST = 0.0005  # share of made-up samples above which a spectrum says so


def traces(subjects: Sequence[Subject]) -> Section:
    """Return displacement and current over time."""
    moved = _named(subjects, [subject.displacement() for subject in subjects])
    currents = _named(subjects, [subject.setpoint() for subject in subjects])
    words = []
    levels = next((each.facts.levels for each in subjects if each.facts.levels != Levels()), Levels())
    damping: list[tuple[float, float]] = next(
        (spans for each in subjects if not each.facts.without_friction and (spans := each.signals.damping())),
        [],
    )
    if len(subjects) > 1 and damping:
        words.append(f'Shaded: damping on in {subjects[0].name}.')
    if levels == Levels():
        words.append(f'The levels of the policy are not drawn: {subjects[0].facts.levels_remark}.')
    words += _absent(
        subjects, (Subject.displacement, 'no displacement'), (Subject.setpoint, 'no current setpoint')
    )
    chart = None
    if moved or currents:
        first = min(float(series.x[0]) for series in (*moved, *currents))
        last = max(float(series.x[-1]) for series in (*moved, *currents))
        undamped = subjects[0].facts.undamped
        grey = None if undamped is None else Named('', undamped.time, undamped.displacement)
        if grey is not None:
            of = f' of {subjects[0].name}' if len(subjects) > 1 else ''
            words.append(f'Grey: the undamped mount on the same excitation{of}, computed with 0 A.')
        differ = subjects[-1].comparison is not None
        if differ:
            words.append(f'B - A: {subjects[-1].name} less {subjects[0].name}.')
        chart = charts.time_traces(
            moved, currents, levels, damping, limits=(first, last), undamped=grey, differ=differ
        )
    return Section('traces', 'Displacement and current', words, chart)


def switching(subjects: Sequence[Subject]) -> Section:
    """Return when damping was switched, what happened meanwhile, and the marks of the recording."""
    said, tables = Sentences(subjects), []
    for subject in subjects:
        spans = subject.signals.damping()
        if subject.facts.without_friction:
            said.say(subject, f'damping is not applicable: {subject.facts.without_friction}')
        elif spans is None:
            said.say(subject, 'when damping was switched was not recorded')
        elif not spans:
            said.say(subject, 'damping was never switched on')
        else:
            tables.append(_switching_table(subjects, subject, spans))
        if marks := subject.signals.marks():
            rows: list[tuple[Cell, ...]] = [
                (Link(_time_cell(time), 'traces', time, _AROUND), mark.kind, mark.text)
                for time, mark in marks[:_TOLD]
            ]
            tables.append(Table(('time (s)', 'kind', 'text'), rows, f'{_of(subjects, subject)}marks'))
    return Section('switching', 'Switching and marks', said.told(), None, tables)


def loops(subjects: Sequence[Subject]) -> Section:
    """Return mount force and friction force over displacement."""
    mount: list[Named] = []
    friction: list[Named] = []
    said = Sentences(subjects)
    for subject in subjects:
        moved = subject.true_displacement() or subject.displacement()
        stretch, how = _loop_stretch(subject)
        found = False
        for force, group in ((subject.mount_force(), mount), (subject.friction_force(), friction)):
            if force is None or moved is None or stretch is None:
                continue
            x, y = _together(moved, force, stretch)
            if len(x) > 2:
                group.append(_series(subjects, subject, x, y))
                found = True
        said.say(subject, how if found else 'no force was recorded')
    chart = charts.hysteresis_loops(mount, friction) if mount or friction else None
    return Section('hysteresis', 'Loss hysteresis', said.told(), chart)


def harmonics(subjects: Sequence[Subject]) -> Section:
    """Return harmonics 1 to 8 of the mount force, its distortion and the work per cycle."""
    said = Sentences(subjects)
    found_of: list[Named] = []
    rows = []
    for subject in subjects:
        steady, force = subject.steady, subject.mount_force()
        moved = subject.true_displacement() or subject.displacement()
        if force is None or moved is None:
            said.say(subject, 'no mount force was recorded')
        elif steady is None:
            said.say(subject, 'the displacement is not one sine for long enough: no harmonics')
        elif (found := _harmonics_of(moved, force, steady)) is None:
            said.say(subject, 'the mount force was not recorded for long enough there: no harmonics')
        else:
            numbers = np.arange(1.0, len(found.amplitudes) + 1.0)
            found_of.append(_series(subjects, subject, numbers, found.amplitudes))
            rows.append((subject.name, *found.cells))
            said.say(subject, f'over the last {found.periods} periods until {found.end:.2f} s')
    head = (
        'recording', 'frequency (Hz)', 'amplitude (mm)', 'work per cycle (J)', 'distortion (%)',
        *(f'h{number} (N)' for number in range(1, 9)),
    )  # fmt: skip
    tables = [Table(head, rows)] if rows else []
    chart = charts.harmonics_dots(found_of) if found_of else None
    return Section('harmonics', 'Harmonics of the mount force', said.told(), chart, tables)


@dataclass(frozen=True)
class _Harmonics:
    """Harmonics (N) over the last whole periods of a stretch, and what the table says of them."""

    amplitudes: Array
    cells: tuple[str, ...]
    periods: int
    end: float


def _harmonics_of(
    moved: Signal, force: Signal, steady: tuple[tuple[float, float], Sine]
) -> _Harmonics | None:
    stretch, sine = steady
    x, y, time = _together_timed(moved, force, stretch)
    if len(time) < 2 or (time[-1] - time[0]) * sine.frequency < 3.0:
        return None
    inside, periods = whole_periods(time, sine.frequency, _PERIODS)
    amplitudes = periodic.harmonics(time[inside], y[inside], sine.frequency)
    cells = (
        f'{sine.frequency:.3f}',
        f'{1e3 * sine.amplitude:.3f}',
        f'{cycle_work(x[inside], y[inside], periods):.3f}',
        f'{100.0 * distortion(amplitudes):.1f}',
        *(f'{value:.2f}' for value in amplitudes),
    )
    return _Harmonics(amplitudes, cells, periods, float(time[inside][-1]))


def spectra(subjects: Sequence[Subject]) -> Section:
    """Return the amplitude spectral densities of displacement, mount force and chassis acceleration."""
    groups: list[tuple[str, list[Named]]] = []
    words = ['From where control was active; Hann windows of 2.048 s that overlap by half.']
    said = Sentences(subjects)
    for label, factor, of in (
        ('displacement\n(mm/√Hz)', 1e3, Subject.displacement),
        ('mount force\n(N/√Hz)', 1.0, Subject.mount_force),
        ('chassis acceleration\n(m/s²/√Hz)', 1.0, Subject.acceleration),
    ):
        group = []
        for subject in subjects:
            signal = of(subject)
            density = None if signal is None else _density(subject, signal)
            if density is None:
                continue
            frequency, values, made_up = density
            if made_up > _LEAST_LOST:
                share = f'{100.0 * made_up:.1f} % of the samples of the {label.splitlines()[0]}'
                said.say(subject, f'{share} are missing and were replaced by straight lines')
            group.append(_series(subjects, subject, frequency, factor * values))
        if group:
            groups.append((label, group))
    words += said.told()
    words += _absent(
        subjects, (Subject.mount_force, 'no mount force'), (Subject.acceleration, 'no chassis acceleration')
    )
    chart = charts.spectra(groups) if groups else None
    return Section('spectra', 'Spectra', words, chart)


def sweep(subjects: Sequence[Subject]) -> Section | None:
    """Return peak displacement and chassis acceleration by frequency; None where nothing was swept."""
    said = Sentences(subjects)
    peaks, accelerations = [], []
    for subject in subjects:
        swept, moved, acceleration = subject.sweep(), subject.displacement(), subject.acceleration()
        if swept is None or moved is None:
            said.say(subject, 'the excitation is no sweep')
            continue
        peaks.append(_series(subjects, subject, *peak_per_band(swept.at(moved.time), moved.values)))
        if acceleration is not None:
            bands = rms_per_band(swept.at(acceleration.time), acceleration.values)
            accelerations.append(_series(subjects, subject, *bands))
    if not peaks:
        return None
    chart = charts.sweep_bands(peaks, accelerations, subjects[0].facts.levels)
    rows = [
        (f'{edge:g} .. {edge + 1:g}', *(_band_cell(series, edge) for series in peaks))
        for edge in sorted(set(chain.from_iterable(series.x.tolist() for series in peaks)))
    ]
    head = ('band (Hz)', *(f'peak (mm){", " if series.name else ""}{series.name}' for series in peaks))
    words = ['In bands of 1 Hz, by the frequency of the excitation at that moment.', *said.told()]
    return Section('sweep', 'Sweep', words, chart, [Table(head, rows, folded=True)])


def signals(subjects: Sequence[Subject]) -> Section | None:
    """Return a few signals of recordings that are not of this project; None where all topics are."""
    groups: dict[str, list[Named]] = {}
    for subject in subjects:
        if subject.displacement() is not None:
            continue
        for label, series in _foreign(subject):
            if label in groups or len(groups) < _FOREIGN:
                groups.setdefault(label, []).append(_series(subjects, subject, *series))
    if not groups:
        return None
    words = [f'The first {len(groups)} numbers that change; their units are not known here.']
    return Section('signals', 'Recorded signals', words, charts.plain_traces(list(groups.items())))


def _foreign(subject: Subject) -> list[tuple[str, tuple[Array, Array]]]:
    found = []
    recording = subject.signals.recording
    for topic in recording:
        try:
            series = recording[topic]
            if len(series) < 2:
                continue
            for column in series.names:
                if 'stamp' in column or 'covariance' in column:
                    continue
                values = series[column]
                known = values[np.isfinite(values)]
                if len(known) and np.ptp(known) > 0.0:
                    short = column if len(column) <= _LABEL else f'…{column[-_LABEL:]}'
                    found.append((f'{topic}\n{short}', (series.time - series.time[0], values)))
        except ValueError:  # no columns: strings, images, messages of different shape
            continue
    return found


# What several sections need.


def _named(subjects: Sequence[Subject], signals: Sequence[Signal | None]) -> list[Named]:
    return [
        _series(subjects, subject, signal.time, signal.values)
        for subject, signal in zip(subjects, signals, strict=True)
        if signal is not None
    ]


def _series(subjects: Sequence[Subject], subject: Subject, x: Array, y: Array) -> Named:
    return Named(_name(subjects, subject), x, y, subject.facts.colour)


def _name(subjects: Sequence[Subject], subject: Subject) -> str:
    return subject.name if len(subjects) > 1 else ''


def _of(subjects: Sequence[Subject], subject: Subject) -> str:
    return f'{subject.name}: ' if len(subjects) > 1 else ''


def _absent(subjects: Sequence[Subject], *wanted: tuple[OfSubject, str]) -> list[str]:
    said = Sentences(subjects)
    for of, what in wanted:
        for subject in subjects:
            if of(subject) is None:
                said.say(subject, f'{what} was recorded')
    return said.told()


def _switching_table(
    subjects: Sequence[Subject], subject: Subject, spans: Sequence[tuple[float, float]]
) -> Table:
    moved, current = subject.displacement(), subject.setpoint()
    rows = [
        (
            Link(_time_cell(begin), 'traces', begin, _AROUND),
            Link(_time_cell(end), 'traces', end, _AROUND),
            quantity_text(end - begin, 's'),
            peak_within(moved, begin, end, 'm'),
            peak_within(current, begin, end, 'A'),
        )
        for begin, end in spans[:_TOLD]
    ]
    more = f' (the first {_TOLD} of {len(spans)})' if len(spans) > _TOLD else ''
    head = ('on (s)', 'off (s)', 'lasted', 'highest displacement', 'highest current')
    return Table(head, rows, f'{_of(subjects, subject)}damping on{more}')


def peak_within(signal: Signal | None, begin: float, end: float, unit: str) -> Cell:
    """Return the highest absolute value between two times (s), with a link to where it is."""
    if signal is None:
        return 'not recorded'
    inside = (signal.time >= begin) & (signal.time <= end)
    time, values = signal.time[inside], np.abs(signal.values[inside])
    if not np.isfinite(values).any():
        return 'unknown'
    place = int(np.nanargmax(values))
    return Link(quantity_text(float(values[place]), unit), 'traces', float(time[place]), _AROUND)


def _loop_stretch(subject: Subject) -> tuple[tuple[float, float] | None, str]:
    """Return the stretch (s) of which loops are drawn, and what it is."""
    steady = subject.steady
    if steady is not None:
        (begin, end), sine = steady
        first = max(begin, end - _LOOPS / sine.frequency)
        return (first, end), f'the last periods at {sine.frequency:.2f} Hz, {first:.2f} to {end:.2f} s'
    moved = subject.displacement()
    if moved is None or not np.isfinite(moved.values).any():
        return None, ''
    if spans := subject.signals.damping():
        begin, end = spans[0][0], min(spans[0][1], spans[0][0] + _WITHOUT_PERIOD)
        return (begin, end), f'the first time with damping on, {begin:.2f} to {end:.2f} s'
    middle = float(moved.time[np.nanargmax(np.abs(moved.values))])
    begin, end = middle - 0.5 * _WITHOUT_PERIOD, middle + 0.5 * _WITHOUT_PERIOD
    return (begin, end), f'around the largest displacement, {begin:.2f} to {end:.2f} s'


def _together(moved: Signal, force: Signal, stretch: tuple[float, float]) -> tuple[Array, Array]:
    x, y, _ = _together_timed(moved, force, stretch)
    return x, y


def _together_timed(moved: Signal, force: Signal, stretch: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Return displacement, force and time at the samples of the force within `stretch`, both known."""
    inside = (force.time >= stretch[0]) & (force.time <= stretch[1])
    time, y = force.time[inside], force.values[inside]
    known = np.isfinite(moved.values)
    x = np.interp(time, moved.time[known], moved.values[known]) if known.any() else np.full(len(time), np.nan)
    both = np.isfinite(x) & np.isfinite(y)
    return x[both], y[both], time[both]


def _density(subject: Subject, signal: Signal) -> tuple[Array, Array, float] | None:
    """Return frequencies, densities and the share of samples that were made up."""
    inside = signal.time >= subject.active_from()
    rate = subject.signals.sample_rate
    _, values, made_up = evenly(signal.time[inside], signal.values[inside], rate)
    if len(values) < _LEAST_SAMPLES or np.ptp(values) == 0.0:  # too short, or nothing moves
        return None
    return *amplitude_density(values, rate), made_up / len(values)


def _band_cell(series: Named, edge: float) -> str:
    place = np.flatnonzero(series.x == edge)
    return f'{1e3 * series.y[place[0]]:.3f}' if len(place) else ''


def _time_cell(seconds: float) -> str:
    return f'{seconds:.3f}'
