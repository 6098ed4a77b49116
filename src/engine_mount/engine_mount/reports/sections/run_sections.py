"""The sections of a report about the run itself: coil, tracking, losses, differences, parameters."""

import math
from collections.abc import Sequence

import numpy as np

from engine_mount.recordings.difference import by_importance, quantity_text, time_text
from engine_mount.recordings.losses import sentences as audit_sentences
from engine_mount.recordings.matching import alignment_sentence
from engine_mount.recordings.session import session_values
from engine_mount.reports.sections import charts
from engine_mount.reports.sections.charts import Named
from engine_mount.reports.sections.coil_load import CoilLoad, coil_load
from engine_mount.reports.sections.section import Link, Section, Table
from engine_mount.reports.sections.subject import Subject
from engine_mount.reports.sections.wording import Sentences
from engine_mount.reports.signals import Signal
from mount_ros.topics import COIL_RIPPLE, CURRENT_SETPOINT, SIM_TRUTH

_COVERING = 0.95  # chosen: this share of the longest counts as all
_ROWS = 25  # of the table of differences
HEAD_OF_SESSION = ('scenario', 'mode', 'started')


def coil(subjects: Sequence[Subject]) -> Section:
    """Return current and heat of the coil."""
    said, rows = Sentences(subjects), []
    for subject in subjects:
        prefix = f'{subject.name}: ' if len(subjects) > 1 else ''
        if subject.facts.without_friction:
            said.say(subject, f'not applicable: {subject.facts.without_friction}')
            continue
        current, what = _current(subject)
        if current is None:
            said.say(subject, 'no current was recorded')
            continue
        said.say(subject, f'{what}; {subject.facts.resistance_remark}')
        setpoint = subject.signals.signal(CURRENT_SETPOINT.name, 'coil_current')
        for stretch, inside in _stretches(subject, current):
            load = _load(subject, current, inside, setpoint)
            rows.append((f'{prefix}{stretch}', *_load_cells(load)))
    head = (
        '', 'time (s)', 'rms current (A)', 'highest (A)', 'heat R i² (W)', 'heat (J)', 'at the limit (%)',
    )  # fmt: skip
    return Section(
        'coil', 'Current and load of the coil', said.told(), None, [Table(head, rows)] if rows else []
    )


def tracking(subjects: Sequence[Subject]) -> Section:
    """Return the true friction force against the wanted one."""
    wanted, actual, said = [], [], Sentences(subjects)
    damping: list[tuple[float, float]] = []
    for subject in subjects:
        found = subject.facts.tracking
        if found is None:
            said.say(subject, subject.facts.tracking_remark)
            continue
        name = subject.name if len(subjects) > 1 else ''
        wanted.append(Named(name, found.time, found.wanted))
        actual.append(Named(name, found.time, found.actual))
        damping = damping or subject.signals.damping() or []
        error = (
            'damping was never on, so there is no error to tell'
            if math.isnan(found.error)
            else f'rms error while damping is on: {100.0 * found.error:.1f} % of the peak wanted force'
        )
        said.say(subject, error)
        said.say(subject, subject.facts.tracking_remark)
    chart = (
        charts.tracking(wanted, actual, damping, _around_largest(wanted[0])) if wanted and damping else None
    )
    return Section('tracking', 'Tracking error against the truth', said.told(), chart)


def losses(subjects: Sequence[Subject]) -> Section:
    """Return what is missing of each topic, and the faults."""
    words, tables = [], []
    for subject in subjects:
        topics, lost = subject.audits, subject.losses
        prefix = f'{subject.name}: ' if len(subjects) > 1 else ''
        told = audit_sentences(topics, lost)
        words.append(f'{prefix}{told[-1]}')
        if lost.faults:
            faults = [(_moment(fault.time), fault.node, fault.sentence) for fault in lost.faults]
            tables.append(Table(('time', 'node', 'fault'), faults, f'{prefix}faults'))
        rows = [
            (
                name,
                *(_count(value) for value in (entry.expected, entry.present, entry.lost, entry.duplicated)),
                _scaled(entry.longest_gap_s, 1e3),
                _scaled(entry.jitter_s, 1e6),
                entry.remark,
            )
            for name, entry in topics.items()
        ]
        marked = frozenset(place for place, entry in enumerate(topics.values()) if not entry.sound)
        head = (
            'topic', 'expected', 'present', 'lost', 'twice', 'longest gap (ms)', 'jitter (µs)', 'remark',
        )  # fmt: skip
        tables.append(Table(head, rows, prefix.removesuffix(': '), marked))
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
    ordered = by_importance(comparison.signals)
    rows = [
        (
            signal.name,
            f'{signal.differing} of {signal.samples}',
            '' if signal.first is None else _moment(signal.first.time),
            'unknown'
            if signal.largest is None
            else quantity_text(abs(signal.largest.difference), signal.unit),
            '' if signal.largest is None else _moment(signal.largest.time),
            quantity_text(signal.rms, signal.unit),
        )
        for signal in ordered[:_ROWS]
    ]
    if len(ordered) > _ROWS:
        words.append(f'{len(ordered) - _ROWS} more signals differ than the table holds.')
    head = ('signal', 'samples that differ', 'first', 'largest', 'at', 'rms')
    return Section('differences', 'Differences', words, None, [Table(head, rows)] if rows else [])


def parameters(subjects: Sequence[Subject]) -> Section:
    """Return parameters and versions, those that differ between the recordings marked."""
    told = [session_values(subject.signals.session) for subject in subjects]
    words = [
        f'{subject.name}: the recording has no session message, so parameters and versions are not known.'
        for subject, values in zip(subjects, told, strict=True)
        if not values
    ]
    if any(told):
        words.append('Parameters that a run without nodes does not list have their defaults.')
    names = list(dict.fromkeys(name for values in told for name in values))
    versions = [name for name in names if name.startswith('versions.')]
    others = [name for name in names if name not in versions and name not in HEAD_OF_SESSION]
    heads = ('', *(subject.name for subject in subjects))
    tables = [
        _parameter_table(heads, group, told, title, folded)
        for group, title, folded in ((versions, 'Versions', False), (others, 'Parameters', len(others) > 20))
        if group
    ]
    return Section('parameters', 'Parameters and versions', words, None, tables)


def _parameter_table(
    heads: Sequence[str], names: Sequence[str], told: Sequence[dict], title: str, folded: bool
) -> Table:
    rows = [(name.removeprefix('versions.'), *(_value(values, name) for values in told)) for name in names]
    marked = frozenset(place for place, row in enumerate(rows) if len(set(row[1:])) > 1)
    return Table(heads, rows, title, marked, folded)


def _value(values: dict, name: str) -> str:
    if name not in values:
        return '' if values else 'not known'
    value = values[name]
    return (
        f'{value:g}'
        if isinstance(value, float)
        else ', '.join(map(str, value))
        if isinstance(value, list)
        else str(value)
    )


def _current(subject: Subject) -> tuple[Signal | None, str]:
    """Return the current that is known for most of the recording, and what it is; the truest of equals."""
    found = [
        (signal, what)
        for topic, what in (
            (SIM_TRUTH, 'the true coil current'),
            (COIL_RIPPLE, 'the measured mean coil current'),
            (CURRENT_SETPOINT, 'the current setpoint, for the current was not recorded throughout'),
        )
        if (signal := subject.signals.signal(topic.name, 'coil_current')) is not None
    ]
    lengths = [int(np.count_nonzero(np.isfinite(signal.values))) for signal, _ in found]
    for (signal, what), length in zip(found, lengths, strict=True):
        if length > 0 and length >= _COVERING * max(lengths):
            return signal, what
    return None, ''


def _stretches(subject: Subject, current: Signal) -> list[tuple[str, np.ndarray]]:
    """Return the parts of a recording over which the load is told, as masks of the samples."""
    time = current.time
    found = [('whole recording', np.full(len(time), True))]
    begin = subject.active_from()
    if math.isfinite(begin) and (time >= begin).any():
        found.append(('while control was active', time >= begin))
    on = np.zeros(len(time), bool)
    for first, last in subject.signals.damping() or []:
        on |= (time >= first) & (time < last)
    if on.any():
        found.append(('while damping was on', on))
    return found


def _load(
    subject: Subject, current: Signal, inside: np.ndarray, setpoint: Signal | None
) -> tuple[CoilLoad, float]:
    """Return the load by the current, and the share of time at which the setpoint is at its limit."""
    masked = np.where(inside, current.values, np.nan)
    load = coil_load(current.time, masked, subject.facts.resistance, None)
    if setpoint is None or subject.facts.levels.current_limit is None:
        return load, math.nan
    first, last = current.time[inside][0], current.time[inside][-1]
    chosen = np.interp(setpoint.time, current.time, inside.astype(float)) > 0.5
    within = chosen & (setpoint.time >= first) & (setpoint.time <= last)
    asked = np.where(within, setpoint.values, np.nan)
    limited = coil_load(setpoint.time, asked, subject.facts.resistance, subject.facts.levels.current_limit)
    return load, limited.share_at_limit


def _load_cells(found: tuple[CoilLoad, float]) -> tuple[str, ...]:
    load, share = found
    return (
        f'{load.duration:.2f}',
        _digits(load.rms_current, 3),
        _digits(load.peak_current, 3),
        _digits(load.mean_heat, 3),
        _digits(load.energy, 2),
        _digits(100.0 * share, 2),
    )


def _digits(value: float, digits: int) -> str:
    return 'not known' if math.isnan(value) else f'{value:.{digits}f}'


def _moment(time: float) -> Link:
    return Link(time_text(time), 'traces', time)


def _around_largest(force: Named) -> tuple[float, float]:
    """Return limits (s) that show the time when the force is largest."""
    moment = float(force.x[np.nanargmax(np.abs(force.y))])
    return moment - 0.4, moment + 0.6


def _count(value: int | None) -> str:
    return '' if value is None else str(value)


def _scaled(value: float, factor: float) -> str:
    return '' if math.isnan(value) else f'{factor * value:.1f}'
