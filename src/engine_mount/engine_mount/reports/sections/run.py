"""The sections of a report about the run itself: coil, tracking, losses, differences, parameters."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_mount.recordings.difference import signal_table
from engine_mount.recordings.losses import sentences
from engine_mount.recordings.matching import alignment_sentence
from engine_mount.recordings.session import session_values
from engine_mount.reports.drawing.chart import COLOUR_OF, DASHED, Array, Chart, Curve, Panel
from engine_mount.reports.sections.motion import AFTER, BEFORE, TIME_LABEL
from engine_mount.reports.sections.section import Section, Table, moment
from engine_mount.reports.sections.subject import Signal, Subject, Tracking, shared_sentences

_COVERING = 0.95  # chosen: this share of the longest counts as all
_FOLDED = 20  # parameters, chosen: more are shown on demand
HEAD_OF_SESSION = ('scenario', 'mode', 'started')
_CURRENTS = {
    'true current': 'the true coil current',
    'measured current': 'the measured mean coil current',
    'setpoint': 'the current setpoint, for the current was not recorded throughout',
}
"""By which the load of the coil is known, the truest first."""


class CoilLoad(NamedTuple):
    """Time (s), rms and highest current (A), mean heat R i^2 (W) and its sum (J) of a coil."""

    duration: float
    rms_current: float
    peak_current: float
    mean_heat: float
    energy: float


def coil(subjects: Sequence[Subject]) -> Section:
    """Return current and heat of the coil."""
    said, rows = [], []
    for subject in subjects:
        if subject.run.without_friction:
            said.append((subject, f'not applicable: {subject.run.without_friction}'))
            continue
        current, what = _current(subject)
        if current is None:
            said.append((subject, 'no current was recorded'))
            continue
        run = subject.run
        resistance = f'R = {run.resistance:g} ohm'
        if run.unknown:
            said.append((subject, f'{what}; {resistance} assumed, its default: {run.unknown}'))
        else:
            said.append((subject, f'{what}; {resistance}, limit {run.current_limit:g} A'))
        for stretch, inside in _stretches(subject, current.time):
            known = np.where(inside, current.values, np.nan)
            load = coil_load(current.time, known, run.resistance)
            figures = zip(load[1:], (3, 3, 3, 2), strict=True)
            cells = ['not known' if math.isnan(value) else f'{value:.{n}f}' for value, n in figures]
            rows.append((f'{subject.prefix}{stretch}', f'{load.duration:.2f}', *cells))
    head = (
        '', 'time (s)', 'rms current (A)', 'highest (A)', 'heat R i² (W)', 'heat (J)',
    )  # fmt: skip
    words, tables = shared_sentences(subjects, said), [Table(head, rows)] if rows else []
    return Section('coil', 'Current and load of the coil', words, None, tables)


def coil_load(time: Array, current: Array, resistance: float) -> CoilLoad:
    """Return the load of a coil of `resistance` (ohm) by `current` (A) at `time` (s).

    Each sample holds until the next; unknown ones do not count. NaN where nothing is known.
    """
    known, held = np.isfinite(current), np.diff(time, append=time[-1:])
    if len(time) > 1:
        held[-1] = np.median(held[:-1])
    duration = held[known].sum()
    if duration <= 0.0:
        return CoilLoad(0.0, *(math.nan,) * 4)
    flowing = current[known]
    mean_square = np.sum(flowing**2 * held[known]) / duration
    heat = resistance * mean_square
    return CoilLoad(duration, math.sqrt(mean_square), float(np.max(np.abs(flowing))), heat, heat * duration)


def tracking(subjects: Sequence[Subject]) -> Section:
    """Return wanted and true friction force over time, and their difference."""
    said: list[tuple[Subject, str]] = []
    wanted: list[Curve] = []
    forces, errors = [], []
    shade = None
    view = (0.0, 0.0)
    for subject in subjects:
        found = subject.tracking
        if not isinstance(found, Tracking):
            said.append((subject, found))
            continue
        error = f'rms error while damping is on: {100.0 * found.error:.1f} % of the peak wanted force'
        if math.isnan(found.error):
            error = 'damping was never on, so there is no error to tell'
        said += [(subject, error), (subject, found.remark)]
        if not wanted:
            strongest = found.time[np.nanargmax(np.abs(found.wanted))]
            view = strongest - BEFORE, strongest + AFTER
        shade = shade or subject.shade
        force = subject.curve('true', found.time, found.actual)
        name = force.name.replace('true', 'wanted', 1)
        forces.append(force)
        wanted.append(Curve(name, found.time, found.wanted, COLOUR_OF['desired_force'], DASHED))
        errors.append(subject.curve('error', found.time, found.actual - found.wanted))
    chart = None
    if wanted and shade:
        panels = [Panel('friction force (N)', [*forces, *wanted], share=1.6)]
        panels.append(Panel('true minus wanted (N)', errors))
        title = 'Friction force against the wanted one'
        chart = Chart('tracking', title, TIME_LABEL, panels, shade, view=view)
    return Section('tracking', 'Tracking error against the truth', shared_sentences(subjects, said), chart)


def losses(subjects: Sequence[Subject]) -> Section:
    """Return what is missing of each topic, and the faults."""
    words, tables = [], []
    for subject in subjects:
        words += [f'{subject.prefix}{each}' for each in sentences(subject.audit.topics, subject.losses)]
        if subject.losses.faults:
            faults = [(moment(fault.time), fault.node, fault.sentence) for fault in subject.losses.faults]
            tables.append(Table(('time', 'node', 'fault'), faults, f'{subject.prefix}faults'))
        found = subject.audit.table
        tables.append(Table(found.heads, found.rows, subject.prefix.removesuffix(': '), found.marked))
    return Section('losses', 'Losses and faults', words, None, tables)


def differences(subjects: Sequence[Subject]) -> Section | None:
    """Return in words and figures how the last recording differs from the first, where it was compared."""
    comparison = subjects[-1].comparison
    if comparison is None:
        return None
    words = [
        f'A is {comparison.name_a}, B is {comparison.name_b}; {alignment_sentence(comparison.alignments)}.',
        *(f'- {sentence}' for sentence in comparison.sentences()),
    ]
    found = signal_table(comparison.signals)
    tables = [Table(found.heads, found.rows)] if found.rows else []
    return Section('differences', 'Differences', words, None, tables)


def parameters(subjects: Sequence[Subject]) -> Section:
    """Return parameters and versions, those that differ between the recordings marked."""
    sessions = [session_values(subject.session) for subject in subjects]
    words = [
        f'{subject.name}: the recording has no session message, so parameters and versions are not known.'
        for subject, values in zip(subjects, sessions, strict=True)
        if not values
    ]
    if any(sessions):
        words.append('Parameters that a run without nodes does not list have their defaults.')
    names = list(dict.fromkeys(name for values in sessions for name in values))
    versions = [name for name in names if name.startswith('versions.')]
    others = [name for name in names if name not in versions and name not in HEAD_OF_SESSION]
    tables = []
    for title, group in (('Versions', versions), ('Parameters', others)):
        rows = [
            (name.removeprefix('versions.'), *(_value(values, name) for values in sessions)) for name in group
        ]
        marked = frozenset(place for place, row in enumerate(rows) if len(set(row[1:])) > 1)
        head = ('', *(subject.name for subject in subjects))
        tables.append(Table(head, rows, title, marked, group is others and len(group) > _FOLDED))
    tables = [table for table in tables if table.rows]
    return Section('parameters', 'Parameters and versions', words, None, tables)


def _current(subject: Subject) -> tuple[Signal | None, str]:
    """Return the current that is known for most of the recording, and what it is; the truest of equals."""
    found = [(signal, what) for name, what in _CURRENTS.items() if (signal := subject[name]) is not None]
    lengths = [np.count_nonzero(np.isfinite(signal.values)) for signal, _ in found]
    for (signal, what), length in zip(found, lengths, strict=True):
        if length > 0 and length >= _COVERING * max(lengths):
            return signal, what
    return None, ''


def _stretches(subject: Subject, time: Array) -> list[tuple[str, np.ndarray]]:
    """Return the parts of a recording over which the load is told, as masks of the samples at `time`."""
    on = np.zeros(len(time), bool)
    for first, last in subject.damping or []:
        on |= (time >= first) & (time < last)
    active = (time >= subject.active_from) & math.isfinite(subject.active_from)
    found = (
        ('whole recording', np.full(len(time), True)),
        ('while control was active', active),
        ('while damping was on', on),
    )
    return [(name, inside) for name, inside in found if inside.any()]


def _value(values: Mapping[str, Any], name: str) -> str:
    if name not in values:
        return '' if values else 'not known'
    value = values[name]
    if isinstance(value, list):
        return ', '.join(map(str, value))
    return f'{value:g}' if isinstance(value, float) else str(value)
