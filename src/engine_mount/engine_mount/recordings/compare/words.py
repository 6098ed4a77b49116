"""A comparison in words, the most important first, as a table, and as JSON."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from engine_mount.recordings.compare.compare import Comparison, TopicComparison
from engine_mount.recordings.compare.lag import Lag
from engine_mount.recordings.compare.quantity_text import quantity_text, time_text
from engine_mount.recordings.compare.signal_difference import Moment, SignalDifference
from engine_mount.recordings.events.switching_changes import SwitchingChange
from engine_mount.recordings.run.screen import Table
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

_ROWS = 10  # of the table
_TOLD = 6  # signals, switchings, session entries told one by one
_LEAST_LAG = 0.05e-3  # s, chosen: below, the estimate says nothing
_OUTPUTS = (f'{CURRENT_SETPOINT.name}.coil_current', f'{CONTROL_TRACE.name}.current')


def sentences(comparison: Comparison) -> list[str]:
    """Return what differs, most important first; the last sentence says what is equal."""
    return [
        *differences(comparison),
        *_reasons(comparison),
        *_samples(comparison),
        *(f'{topic.name}: {topic.remark}' for topic in comparison.topics if topic.remark),
        *_unmatched(comparison),
        _rest(comparison),
    ]


def differences(comparison: Comparison) -> list[str]:
    """Return the sentences about switching and signals that differ beyond the tolerances."""
    return [*_switching(comparison), *signal_sentences(comparison.differing)]


def by_importance(signals: Iterable[SignalDifference]) -> list[SignalDifference]:
    """Return the differing ones among `signals`: the output, the input, then by their share of the signal.

    What only a simulator knows comes last.
    """
    ranks = {name: rank for rank, name in enumerate((*_OUTPUTS, f'{DISPLACEMENT.name}.mount'))}

    def importance(signal: SignalDifference) -> tuple[int, bool, float, str]:
        rank = ranks.get(signal.quantity, len(ranks))
        return rank, signal.topic.startswith('sim/'), -signal.share, signal.name

    return sorted((signal for signal in signals if signal.differing), key=importance)


def as_table(comparison: Comparison) -> Table:
    """Return the most important of the differing signals as a table."""
    ordered = by_importance(comparison.signals)
    more = len(ordered) - _ROWS
    return Table(
        'The largest differences',
        'lrrrrrr',
        [_row(signal) for signal in ordered[:_ROWS]],
        ('signal', 'samples', 'first (s)', 'largest', 'at (s)', 'rms', 'B later'),
        f'{more} more differ; see --json' if more > 0 else '',
    )


def _row(signal: SignalDifference) -> tuple[str, ...]:
    largest = signal.largest
    return (
        f'{signal.mount}{signal.topic}\n{signal.signal}',  # two lines, so that all fits into 80 characters
        str(signal.differing),
        '' if signal.first is None else f'{signal.first.time:.3f}',
        'unknown' if largest is None else quantity_text(abs(largest.difference), signal.unit),
        '' if largest is None else f'{largest.time:.3f}',
        quantity_text(signal.rms, signal.unit),
        _lag_text(signal.lag),
    )


def as_json(comparison: Comparison) -> dict[str, Any]:
    """Return everything as JSON knows it: unknown is null, times in s on the time axis of A."""
    alignment = comparison.alignment
    return {
        'a': comparison.name_a,
        'b': comparison.name_b,
        'equal': comparison.equal,
        'sentences': sentences(comparison),
        'alignment': {
            'same_stamps': alignment.same_stamps,
            'shift_s': alignment.shift / 1e9,
            'sentence': comparison.alignments.sentence,
        },
        'session': list(comparison.sessions),
        'only_in_a': list(comparison.only_a),
        'only_in_b': list(comparison.only_b),
        'marks_only_in_a': list(comparison.marks_a),
        'marks_only_in_b': list(comparison.marks_b),
        'switching': None
        if comparison.switching is None
        else [_switching_figures(change) for change in comparison.switching],
        'topics': {topic.name: _topic_figures(topic) for topic in comparison.topics},
    }


# Sentences.


def _switching(comparison: Comparison) -> list[str]:
    changes = comparison.switching_changes
    told = [switching_sentence(change) for change in changes[:_TOLD]]
    more = len(changes) - _TOLD
    return [*told, f'{more} more switchings differ'] if more > 0 else told


def switching_sentence(change: SwitchingChange, a: str = 'A', b: str = 'B') -> str:
    """Return the sentence about a switching; `a` and `b` is what the recordings are called."""
    word = 'on' if change.on else 'off'
    mount = change.mount.replace('/', ': ')
    if change.time_b is None:
        return f'{mount}damping is not switched {word} in {b}, in {a} it is at {time_text(change.time)}'
    if change.time_a is None:
        return f'{mount}damping is switched {word} at {time_text(change.time_b)} in {b}, in {a} it is not'
    direction = 'later' if change.moved > 0.0 else 'earlier'
    by = quantity_text(abs(change.moved), 's')
    return f'{mount}switched {word} {by} {direction} in {b}, at {time_text(change.time_b)}'


def signal_sentences(signals: Iterable[SignalDifference], b: str = 'B') -> list[str]:
    """Return the sentences about the most important of the differing `signals`; `b` is what B is called."""
    ordered = by_importance(signals)
    told = [_signal_sentence(signal, b) for signal in ordered[:_TOLD]]
    others = [signal.name for signal in ordered[_TOLD:]]
    if others:
        told.append(f'{len(others)} more signals differ: {_few(others, ", ")}')
    return told


def _signal_sentence(signal: SignalDifference, b: str) -> str:
    first = signal.first
    since = '' if first is None else f', first at {time_text(first.time)}'
    unknown = (
        f'; in one of them {_count(signal.unknown_in_one, "sample")} unknown' if signal.unknown_in_one else ''
    )
    if signal.largest is None:
        return f'{signal.name}: in one of them {_count(signal.unknown_in_one, "sample")} unknown{since}'
    if signal.largest.difference == 0.0:
        return f'{signal.name} differs in the sign of zero{since}{unknown}'
    most = quantity_text(abs(signal.largest.difference), signal.unit)
    return (
        f'{signal.name} differs by at most {most} at {time_text(signal.largest.time)}{since}'
        f'{_lag_words(signal, b)}{unknown}'
    )


def _lag_words(signal: SignalDifference, b: str) -> str:
    if not signal.lag.known or abs(signal.lag.seconds) < _LEAST_LAG:
        return ''
    word = 'later' if signal.lag.seconds > 0.0 else 'earlier'
    remark = f' ({signal.lag.remark})' if signal.lag.remark else ''
    return f'; {b} is {1e3 * abs(signal.lag.seconds):.2f} ms {word}{remark}'


def _lag_text(lag: Lag) -> str:
    if not lag.known:
        return '-'
    return f'{1e3 * lag.seconds:.2f} ms' if abs(lag.seconds) >= _LEAST_LAG else '0'


def _reasons(comparison: Comparison) -> list[str]:
    listed = _few(comparison.sessions, '; ')
    if listed:
        return [f'the sessions differ: {listed}']
    if comparison.equal or not comparison.both_have_session:
        return []
    differing = {signal.topic for signal in comparison.differing}
    inputs = next((topic for topic in comparison.topics if topic.topic == DISPLACEMENT.name), None)
    if inputs is None or not inputs.samples or not differing:
        return []
    if DISPLACEMENT.name in differing:
        return ['the sessions are equal, but the displacements differ, so all else may']
    return ['displacement and session are equal: the programs differ, or one of them began in another state']


def _samples(comparison: Comparison) -> list[str]:
    topics = comparison.incomplete
    outside = () if comparison.common_only else topics
    kinds = (
        ('samples missing in B', [(t.name, t.only_a) for t in topics]),
        ('samples missing in A', [(t.name, t.only_b) for t in topics]),
        ('samples of A before or behind those of B', [(t.name, t.outside_a) for t in outside]),
        ('samples of B before or behind those of A', [(t.name, t.outside_b) for t in outside]),
        ('messages that differ', [(t.name, t.differing_messages) for t in topics]),
    )
    return [
        f'{what}: {_few([f"{count} of {topic}" for topic, count in counts if count], ", ")}'
        for what, counts in kinds
        if any(count for _, count in counts)
    ]


def _unmatched(comparison: Comparison) -> list[str]:
    return [
        f'{what} only in {where}: {_few(names, ", ")}'
        for what, where, names in (
            ('topics', 'A', comparison.only_a),
            ('topics', 'B', comparison.only_b),
            ('marks', 'A', comparison.marks_a),
            ('marks', 'B', comparison.marks_b),
        )
        if names
    ]


def _rest(comparison: Comparison) -> str:
    alike = [signal for signal in comparison.signals if signal.samples and not signal.differing]
    exact = all(signal.exact for signal in alike)
    how = 'equal to the bit' if exact else 'equal within the tolerances'
    switching = '' if comparison.switching is None or comparison.switching_changes else ' and the switching'
    if not comparison.differing and not comparison.switching_changes:
        where = 'everything that both have' if comparison.incomplete else 'everything'
        count = f'{len(alike)} signals of {len({(signal.mount, signal.topic) for signal in alike})} topics'
        return f'{where} is {how} ({count})'
    if not alike:
        return 'no signal is equal'
    return f'everything else is {how} ({len(alike)} of {len(comparison.signals)} signals{switching})'


def _count(number: int, what: str) -> str:
    return f'{number} {what} is' if number == 1 else f'{number} {what}s are'


def _few(names: Sequence[str], separator: str) -> str:
    more = f'{separator}{len(names) - _TOLD} more' if len(names) > _TOLD else ''
    return separator.join(names[:_TOLD]) + more


# JSON.


def _switching_figures(change: SwitchingChange) -> dict[str, Any]:
    return {
        'mount': change.mount.rstrip('/'),
        'kind': 'on' if change.on else 'off',
        'time_a_s': change.time_a,
        'time_b_s': change.time_b,
        'moved_ms': None if change.alone else round(1e3 * change.moved, 6),
    }


def _topic_figures(topic: TopicComparison) -> dict[str, Any]:
    return {
        'samples': topic.samples,
        'missing_in_b': topic.only_a,
        'missing_in_a': topic.only_b,
        'outside_in_a': topic.outside_a,
        'outside_in_b': topic.outside_b,
        'differing_messages': topic.differing_messages,
        'remark': topic.remark,
        'signals': {signal.signal: _signal_figures(signal) for signal in topic.signals},
    }


def _signal_figures(signal: SignalDifference) -> dict[str, Any]:
    return {
        'unit': signal.unit,
        'samples': signal.samples,
        'differing': signal.differing,
        'exact': signal.exact,
        'unknown_in_one': signal.unknown_in_one,
        'first': _moment(signal.first),
        'largest': _moment(signal.largest),
        'rms': _number(signal.rms),
        'lag_ms': _number(1e3 * signal.lag.seconds),
        'lag_remark': signal.lag.remark,
    }


def _moment(moment: Moment | None) -> dict[str, float | None] | None:
    if moment is None:
        return None
    return {
        'time_s': moment.time,
        'a': _number(moment.a),
        'b': _number(moment.b),
        'difference': _number(moment.difference),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
