"""The audit of a recording for people and for programs."""

import math
from collections.abc import Mapping
from typing import Any

from engine_mount.recordings.audit.answers import EDGES, Latency
from engine_mount.recordings.audit.audit import TopicAudit
from engine_mount.recordings.audit.losses import Losses
from engine_mount.recordings.run.screen import Table

_TROUBLES = {'duplicated': 'twice', 'out_of_order': 'late', 'misdated': 'misdated'}
_HEADS = ('topic', 'expected', 'present', 'lost', 'gap ms', 'jitter µs')
_BAR = 40  # characters


def as_json(audits: Mapping[str, TopicAudit], found: Losses) -> dict[str, Any]:
    """Return the figures as JSON knows them: unknown is null; times are in s."""
    return {
        **found.as_json(),
        'topics': {
            name: {
                'expected': entry.expected,
                'present': entry.present,
                'lost': entry.lost,
                'duplicated': entry.duplicated,
                'longest_gap_s': _known(entry.longest_gap_s),
                'out_of_order': entry.out_of_order,
                'misdated': entry.misdated,
                'rate_hz': _known(entry.rate_hz),
                'jitter_s': _known(entry.jitter_s),
                'worst_jitter_s': _known(entry.worst_jitter_s),
                'latency': _latency_json(entry.latency),
                'remark': entry.remark,
            }
            for name, entry in audits.items()
        },
    }


def as_table(audits: Mapping[str, TopicAudit]) -> Table:
    """Return the figures as a table; columns of troubles are left out where no topic has them."""
    troubles = [name for name in _TROUBLES if any(getattr(entry, name) for entry in audits.values())]
    heads = (*_HEADS, *(_TROUBLES[name] for name in troubles))
    rows = [
        (
            name,
            *map(_cell, (entry.expected, entry.present, entry.lost)),
            _scaled(entry.longest_gap_s, 1e3),
            _scaled(entry.jitter_s, 1e6),
            *(_cell(getattr(entry, trouble)) for trouble in troubles),
        )
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
    said = [f'{", ".join(names)}: {remark}' for remark, names in remarks.items()]
    if found.samples is not None:
        said += [f'{what}: {text}' for what, text in found.rows()]
    return [*said, _verdict(audits, found)]


def latency_lines(audits: Mapping[str, TopicAudit]) -> list[str]:
    """Return a histogram, line by line, of each topic whose latency is known."""
    lines = []
    for name, entry in audits.items():
        if entry.latency is not None:
            latency = entry.latency
            lines.append(
                f'{name}: from the stamp to the setpoint at the recorder, median '
                f'{1e3 * latency.median:.2f} ms, 99 % below {1e3 * latency.p99:.2f} ms, '
                f'worst {1e3 * latency.worst:.2f} ms'
            )
            lines += _bars(latency)
    return lines


def _verdict(audits: Mapping[str, TopicAudit], found: Losses) -> str:
    lost = {name: entry.lost for name, entry in audits.items() if entry.lost}
    said = ['Lost: ' + ', '.join(f'{count} of {name}' for name, count in lost.items())] if lost else []
    said += [f'Misdated: {found.misdated} messages'] if found.misdated else []
    said += [f'Unanswered: {found.unanswered} samples'] if found.unanswered else []
    said += [f'Faults: {len(found.faults)}'] if found.faults else []
    if said:
        return '. '.join(said) + '.'
    if not found.whole:
        return 'The recording is not whole: what the notes say is missing, its stamps cannot show.'
    if not any(entry.present for entry in audits.values()):
        return 'The recording is empty: no message came, so none could be lost.'
    judged = sum(entry.expected is not None for entry in audits.values() if entry.present)
    unjudged = sum(entry.expected is None and entry.present > 0 for entry in audits.values())
    if not judged:
        return 'Whether anything was lost cannot be told: no topic has stamps with a rate, none was counted.'
    rest = f'; of {unjudged} others it cannot be told' if unjudged else ''
    return f'Nothing is known to be lost: {judged} topics are complete{rest}.'


def _bars(latency: Latency) -> list[str]:
    most = max(latency.counts)
    places = [place for place, count in enumerate(latency.counts) if count]
    lines = []
    for place in range(places[0], places[-1] + 1):
        count = latency.counts[place]
        bar = '█' * math.ceil(_BAR * count / most)
        lines.append(f'  {_range(place):>16} {count:>8} {bar}')
    return lines


def _range(place: int) -> str:
    if place == 0:
        return 'below 0 ms'
    if place == len(EDGES):
        return f'over {1e3 * EDGES[-1]:g} ms'
    return f'{1e3 * EDGES[place - 1]:g} .. {1e3 * EDGES[place]:g} ms'


def _latency_json(latency: Latency | None) -> dict[str, Any] | None:
    if latency is None:
        return None
    return {
        'median_s': latency.median,
        'p99_s': latency.p99,
        'worst_s': latency.worst,
        'edges_s': list(EDGES),
        'counts': list(latency.counts),
    }


def _known(number: float) -> float | None:
    return None if math.isnan(number) else number


def _scaled(seconds: float, factor: float) -> str:
    return '' if math.isnan(seconds) else f'{factor * seconds:.1f}'


def _cell(count: int | None) -> str:
    return '' if count is None else str(count)
