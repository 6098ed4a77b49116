"""The audit of a recording for people and for programs."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.losses import Losses
from engine_mount.recordings.screen import Table

_FIGURES = (
    *('expected', 'present', 'lost', 'duplicated', 'longest_gap_s', 'out_of_order', 'misdated'),
    *('rate_hz', 'jitter_s', 'worst_jitter_s', 'remark'),
)
_COLUMNS = (('expected', 1), ('present', 1), ('lost', 1), ('longest_gap_s', 1e3), ('jitter_s', 1e6))
_HEADS = ('topic', 'expected', 'present', 'lost', 'gap ms', 'jitter µs')
_TROUBLES = {'duplicated': 'twice', 'out_of_order': 'late', 'misdated': 'misdated'}


def as_json(audits: Mapping[str, TopicAudit], found: Losses) -> dict[str, Any]:
    """Return the figures as JSON knows them: unknown is null; times are in s."""
    topics = {}
    for name, entry in audits.items():
        figures = {figure: getattr(entry, figure) for figure in _FIGURES}
        topics[name] = {figure: None if value != value else value for figure, value in figures.items()}
        latency = entry.latency and {f'{key}_s': value for key, value in asdict(entry.latency).items()}
        topics[name]['latency'] = latency
    return {**found.as_json(), 'topics': topics}


def as_table(audits: Mapping[str, TopicAudit]) -> Table:
    """Return the figures as a table; columns of troubles are left out where no topic has them."""
    troubles = [name for name in _TROUBLES if any(getattr(entry, name) for entry in audits.values())]
    heads = (*_HEADS, *(_TROUBLES[name] for name in troubles))
    columns = (*_COLUMNS, *((name, 1) for name in troubles))
    rows = [
        (name, *(_cell(getattr(entry, figure), factor) for figure, factor in columns))
        for name, entry in audits.items()
    ]
    marked = frozenset(place for place, entry in enumerate(audits.values()) if not entry.sound)
    return Table('Was anything lost?', 'l' + 'r' * (len(heads) - 1), rows, heads, marked=marked)


def sentences(audits: Mapping[str, TopicAudit], found: Losses) -> list[str]:
    """Return what the figures mean, the verdict last."""
    remarks: dict[str, list[str]] = {}
    for name, entry in audits.items():
        if entry.remark:
            remarks.setdefault(entry.remark, []).append(name)
    lines = [f'{", ".join(names)}: {remark}' for remark, names in remarks.items()]
    if found.samples is not None:
        lines += [f'{what}: {text}' for what, text in found.rows()]
    return [*lines, _verdict(audits, found)]


def latency_sentences(audits: Mapping[str, TopicAudit]) -> list[str]:
    """Return a sentence for each topic whose latency is known."""
    return [
        f'{name}: from the stamp to the setpoint at the recorder, median '
        f'{1e3 * entry.latency.median:.2f} ms, '
        f'99 % below {1e3 * entry.latency.p99:.2f} ms, worst {1e3 * entry.latency.worst:.2f} ms'
        for name, entry in audits.items()
        if entry.latency is not None
    ]


def _verdict(audits: Mapping[str, TopicAudit], found: Losses) -> str:
    lost = [f'{entry.lost} of {name}' for name, entry in audits.items() if entry.lost]
    rules = (
        (lost, f'Lost: {", ".join(lost)}'),
        (found.misdated, f'Misdated: {found.misdated} messages'),
        (found.unanswered, f'Unanswered: {found.unanswered} samples'),
        (found.faults, f'Faults: {len(found.faults)}'),
    )
    broken = [sentence for figure, sentence in rules if figure]
    if broken:
        return '. '.join(broken) + '.'
    if not found.whole:
        return 'The recording is not whole: what the notes say is missing, its stamps cannot show.'
    present = [entry for entry in audits.values() if entry.present]
    if not present:
        return 'The recording is empty: no message came, so none could be lost.'
    judged = sum(entry.expected is not None for entry in present)
    if not judged:
        return 'Whether anything was lost cannot be told: no topic has stamps with a rate, none was counted.'
    others = len(present) - judged
    rest = f'; of {others} others it cannot be told' if others else ''
    return f'Nothing is known to be lost: {judged} topics are complete{rest}.'


def _cell(figure: float | None, factor: float) -> str:
    if figure is None or math.isnan(figure):
        return ''
    return str(figure) if factor == 1 else f'{factor * figure:.1f}'
