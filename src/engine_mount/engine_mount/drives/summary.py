"""What a replay says at its end: the figures of `--json`, and the same in words."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from engine_mount.drives.agreement import (
    SETTLED,
    SETTLING,
    recorded_switching,
    replayed_switching,
    switching_changes,
)
from engine_mount.drives.core import Replayed
from engine_mount.drives.inputs.input import ReplayInput
from engine_mount.drives.replay import LOCKSTEP, ReplayOutcome
from engine_mount.recordings.difference import Moment
from engine_mount.recordings.events import Switching
from engine_mount.recordings.screen import Screen, Table
from engine_mount.recordings.session import version_differences, versions_sentence
from mount_recorder.versions import versions

_SHOWN = 8  # switchings in the printed summary


def replay_figures(outcome: ReplayOutcome) -> dict[str, Any]:
    """Return the figures of a replay; times in s on the recording's time axis, unknown is null."""
    given, replayed, found = outcome.given, outcome.replayed, outcome.agreement
    now, before = replayed_switching(given, replayed), recorded_switching(given)
    samples = sum(len(run.stamps) for run in replayed.runs)
    return {
        'source': given.source,
        'recording': str(outcome.folder.recording) if outcome.folder else None,
        'mode': outcome.order.mode,
        'changed': {node: dict(values) for node, values in outcome.order.changes.items()},
        'samples': samples,
        'duration_s': samples * given.sample_time,
        'activations': len(replayed.runs),
        'initialisations': len(replayed.ramps),
        'bridged_samples': sum(run.counts.bridged for run in replayed.runs),
        'restarts': sum(run.counts.restarts for run in replayed.runs),
        'invalid_samples': sum(run.counts.invalid for run in replayed.runs),
        'equal_to_recorded': None if found is None else found.equal,
        'recorded_with': version_differences(given.session, versions()),
        'compared_setpoints': 0 if found is None else found.setpoints.samples,
        'differing_setpoints': None if found is None else found.setpoints.differing,
        'first_difference': _moment(found.setpoints.first if found else None),
        'largest_difference': _moment(found.setpoints.largest if found else None),
        'differing_intermediates': {
            each.signal: each.differing for each in (found.intermediates if found else ()) if each.differing
        },
        'switch_on_s': list(now.on),
        'switch_off_s': list(now.off),
        'recorded_switch_on_s': list(before.on) if before else None,
        'recorded_switch_off_s': list(before.off) if before else None,
        'switching_changes': switching_changes(before, now, given.sample_time) if before else [],
        'peak_current_a': _peak(replayed),
        'recorded_peak_current_a': _recorded_peak(given),
        'control_run_s': replayed.control_time,
        'decoding_displacement_s': outcome.decoding_time,
        'reading_displacement_s': outcome.reading_time,
        'real_time_factor': samples * given.sample_time / outcome.computing_time,
        'real_time_factor_with_reading': samples
        * given.sample_time
        / (replayed.control_time + outcome.reading_time),
        'notes': list(given.notes),
    }


def print_replay(outcome: ReplayOutcome, figures: dict[str, Any], screen: Screen) -> None:
    """Print what a replay gave."""
    rows = [
        ('replayed', _replayed_text(figures)),
        ('settings', _settings_text(outcome)),
        *_named('setpoints', _verdict(outcome)),
    ]
    if outcome.order.foreign is None:
        rows.append(('versions', versions_sentence(figures['recorded_with'], versions())))
    switching = Switching(figures['switch_on_s'], figures['switch_off_s'])
    rows.append(('damping switched', _switching_text(switching)))
    if figures['recorded_switch_on_s'] is not None:
        rows += _named('against the recording', _changes_text(figures['switching_changes']))
    rows.append(('peak current', _peak_text(figures)))
    rows += _named('speed', _speed_text(outcome, figures))
    screen.table(Table(f'replay of {figures["source"]}, {figures["mode"]}', 'll', rows))
    for sentence in figures['notes']:
        screen.note(sentence)


def _named(name: str, sentences: Iterable[str]) -> list[tuple[str, str]]:
    """Return a row for each sentence, the first with the name."""
    return [('' if place else name, sentence) for place, sentence in enumerate(sentences)]


def _replayed_text(figures: dict[str, Any]) -> str:
    text = f'{figures["samples"]} samples of mount_control ({figures["duration_s"]:.1f} s)'
    counts = (
        ('activation{}', figures['activations']),
        ('initialisation{}', figures['initialisations']),
        ('sample{} bridged', figures['bridged_samples']),
        ('start{} afresh', figures['restarts']),
        ('invalid sample{}', figures['invalid_samples']),
    )
    for words, count in counts:
        if count:
            text += f', {count} ' + words.format('' if count == 1 else 's')
    return text


def _settings_text(outcome: ReplayOutcome) -> str:
    changes = [
        f'{node}.{name} = {value}' + _recorded_value(outcome, node, name)
        for node, values in outcome.order.changes.items()
        for name, value in values.items()
    ]
    if outcome.order.foreign is not None:
        return ', '.join(changes) or 'the defaults'
    if outcome.order.table:
        changes.append(f'table of {outcome.order.table}')
    return 'as recorded' + (f' but {", ".join(changes)}' if changes else '')


def _recorded_value(outcome: ReplayOutcome, node: str, name: str) -> str:
    recorded = outcome.given.parameters.get(node, {})
    return f' (recorded {recorded[name]})' if outcome.order.foreign is None and name in recorded else ''


def _verdict(outcome: ReplayOutcome) -> list[str]:
    found = outcome.agreement
    if found is None:
        return ['nothing recorded to compare with']
    sentences = found.sentences
    if found.settling_skipped:
        sentences.append(
            f'not compared: the first {SETTLING:g} s ({found.settling_skipped} setpoints), see the notes; '
            f'then up to {1e6 * SETTLED:g} uA apart is as near as it can be'
        )
    refusals = [run.refusal for run in outcome.replayed.runs if run.refusal]
    return sentences + refusals


def _changes_text(changes: list[str]) -> list[str]:
    if not changes:
        return ['every switching at the same sample']
    more = [f'and {len(changes) - _SHOWN} more'] if len(changes) > _SHOWN else []
    return [f'{len(changes)} switchings differ', *changes[:_SHOWN], *more]


def _switching_text(times: Switching) -> str:
    if not times.on:
        return 'never on'
    pairs = [(on, next((off for off in times.off if off > on), None)) for on in times.on]
    shown = [f'{on:.3f} s to {f"{off:.3f} s" if off is not None else "the end"}' for on, off in pairs]
    more = f' and {len(shown) - _SHOWN} more' if len(shown) > _SHOWN else ''
    return 'on from ' + ', '.join(shown[:_SHOWN]) + more


def _peak_text(figures: dict[str, Any]) -> str:
    recorded = figures['recorded_peak_current_a']
    text = f'{figures["peak_current_a"]:.3f} A'
    if recorded is None or recorded == figures['peak_current_a']:
        return text
    return f'{text}, recorded {recorded:.3f} A ({figures["peak_current_a"] - recorded:+.3f} A)'


def _speed_text(outcome: ReplayOutcome, figures: dict[str, Any]) -> list[str]:
    factor, reading = figures['real_time_factor'], figures['reading_displacement_s']
    decoding = figures['decoding_displacement_s']
    if outcome.order.mode == LOCKSTEP:
        return [f'{factor:.1f} x real time, from the start of mount_control to its last answer']
    return [
        f'{factor:.0f} x real time: displacement decoded ({1e3 * decoding:.1f} ms), all samples judged and '
        f'stepped ({1e3 * figures["control_run_s"]:.1f} ms)',
        f'{figures["real_time_factor_with_reading"]:.0f} x real time with the displacement read from the '
        f'file ({1e3 * reading:.0f} ms)',
    ]


def _peak(replayed: Replayed) -> float | None:
    peaks = [float(np.max(run.setpoints)) for run in replayed.runs if len(run.setpoints)]
    return max(peaks, default=None)


def _recorded_peak(given: ReplayInput) -> float | None:
    if given.answers is None:
        return None
    samples = np.concatenate([run.stamps for run in given.controls])
    currents = given.answers.currents[np.isin(given.answers.stamps, samples)]
    peak = float(np.max(currents)) if len(currents) else math.nan
    return None if math.isnan(peak) else peak


def _moment(moment: Moment | None) -> dict[str, float | None] | None:
    if moment is None:
        return None
    recorded, replayed = (None if math.isnan(value) else value for value in (moment.a, moment.b))
    return {'time_s': moment.time, 'recorded_a': recorded, 'replayed_a': replayed}
