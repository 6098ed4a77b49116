"""What a report begins with: the verdict, the figures that one wants to see first, and what is missing."""

import math
from collections.abc import Sequence

import numpy as np

from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import control_spans
from engine_mount.recordings.difference import quantity_text
from engine_mount.recordings.session import session_values
from engine_mount.reports.sections.run_sections import HEAD_OF_SESSION
from engine_mount.reports.sections.section import Cell, Link, Section, Table
from engine_mount.reports.sections.subject import Subject
from engine_mount.reports.sections.verdict import findings
from engine_mount.reports.sections.wording import Sentences
from engine_mount.reports.signals import Signal

_DIFFERENCE = 'B - A'


def overview(subjects: Sequence[Subject]) -> Section:
    """Return the verdict, the figures, and what the recordings lack, in words."""
    columns = [_figures(subject) for subject in subjects]
    head = ['', *(each.name for each in subjects)]
    rows = [[name, *(column[name] for column in columns)] for name in columns[0]]
    if subjects[-1].comparison is not None:
        head.append(_DIFFERENCE)
        differences = _differences(subjects[0], subjects[-1])
        rows = [[*row, differences.get(str(row[0]), '')] for row in rows]
    words, said = [], Sentences(subjects)
    for subject in subjects:
        prefix = f'{subject.name}: ' if len(subjects) > 1 else ''
        words += [f'{prefix}{warning}.' for warning in subject.signals.recording.warnings]
        if subject.signals.missing:
            said.say(subject, f'missing: {"; ".join(subject.signals.missing)}')
    words += said.told()
    verdict = [
        finding
        for subject in subjects
        for finding in findings(subject, subject.name if len(subjects) > 1 else '')
    ]
    return Section('overview', 'Overview', words, None, [Table(head, rows)], verdict)


def _figures(subject: Subject) -> dict[str, Cell]:
    recording, session = subject.signals.recording, session_values(subject.signals.session)
    moved = subject.displacement()
    return {
        'recording': str(recording.path),
        **{name: str(session.get(name, 'not known')) for name in HEAD_OF_SESSION},
        'messages': str(recording.message_count),
        'length': 'not known' if moved is None else quantity_text(float(np.ptp(moved.time)), 's', 5),
        'peak displacement': _highest(moved, 'm'),
        **_friction_figures(subject),
        **{name: Link(text, 'losses') for name, text in subject.losses.rows()},
    }


def _friction_figures(subject: Subject) -> dict[str, Cell]:
    if subject.facts.without_friction:
        names = ('peak current', 'damping switched on', 'friction force error')
        return dict.fromkeys(names, f'not applicable: {subject.facts.without_friction}')
    spans, setpoint = subject.signals.damping(), subject.setpoint()
    peak = peak_current(subject.signals.recording, control_spans(subject.audits))
    error = subject.facts.tracking.error if subject.facts.tracking else math.nan
    told = 'not recorded' if spans is None else f'{len(spans)} times' if len(spans) != 1 else 'once'
    return {
        'peak current': 'not recorded' if math.isnan(peak) else _at_value(setpoint, peak, 'A'),
        'damping switched on': told if spans is None else Link(told, 'switching'),
        'friction force error': 'not known'
        if math.isnan(error)
        else Link(f'{100.0 * error:.1f} % rms of the peak wanted force', 'tracking'),
    }


def _highest(signal: Signal | None, unit: str) -> Cell:
    if signal is None or not np.isfinite(signal.values).any():
        return 'not recorded'
    place = int(np.nanargmax(np.abs(signal.values)))
    return Link(quantity_text(abs(float(signal.values[place])), unit), 'traces', float(signal.time[place]))


def _at_value(signal: Signal | None, value: float, unit: str) -> Cell:
    """Return `value`, with a link to where the signal first has it."""
    text = quantity_text(value, unit)
    if signal is None or not (signal.values == value).any():
        return text
    return Link(text, 'traces', float(signal.time[np.argmax(signal.values == value)]))


def _differences(first: Subject, last: Subject) -> dict[str, str]:
    """Return how far the figures of the last recording lie from those of the first, by their names."""
    found = {}
    for name, value, unit in (
        ('peak displacement', _peak, 'm'),
        ('peak current', _peak_current, 'A'),
        ('damping switched on', _times_on, ''),
        ('friction force error', _error, '%'),
    ):
        difference = value(last) - value(first)
        if not math.isnan(difference):
            found[name] = f'{"+" if difference > 0.0 else ""}{quantity_text(difference, unit)}'
    return found


def _peak(subject: Subject) -> float:
    moved = subject.displacement()
    known = moved is not None and np.isfinite(moved.values).any()
    return float(np.nanmax(np.abs(moved.values))) if moved is not None and known else math.nan


def _peak_current(subject: Subject) -> float:
    if subject.facts.without_friction:
        return math.nan
    return peak_current(subject.signals.recording, control_spans(subject.audits))


def _times_on(subject: Subject) -> float:
    spans = None if subject.facts.without_friction else subject.signals.damping()
    return math.nan if spans is None else float(len(spans))


def _error(subject: Subject) -> float:
    return 100.0 * subject.facts.tracking.error if subject.facts.tracking else math.nan
