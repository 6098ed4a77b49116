"""A recorded displacement once more through the same controller, as function calls."""

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.drives.agreement import (
    SETTLED,
    SETTLING,
    Agreement,
    agreement,
    moment_figures,
    recorded_switching,
    replayed_switching,
    switching_changes,
)
from engine_mount.drives.core import Replayed, replay_in_core
from engine_mount.drives.inputs.consumed_samples import ReplayError
from engine_mount.drives.inputs.input import DEFAULT_TABLE, ReplayInput, chosen_gap, replay_input, without
from engine_mount.drives.output import write_replay
from engine_mount.recordings.difference import SHOWN
from engine_mount.recordings.recording import Recording, open_mount
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
    session_parameters,
    version_differences,
    versions_sentence,
)
from engine_mount.settings.chosen import (
    Parameters,
    check_effect,
    check_policy,
    chosen_control,
    chosen_specimen,
    control_parameters,
)
from engine_mount.settings.options import owned
from engine_mount.settings.run_folder import RunFolder, make_run_folder
from engine_mount.signals.channels import SCENARIO
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.controller import load_compiled_law
from mount_init.parameters import InitParameters
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.session import time_text
from mount_recorder.versions import versions

CORE = 'core'
REPLAYED_NODES = ('mount_control', 'mount_init')


@dataclass
class Replay:
    """A replay: its input, the answers, and how they agree with those recorded (None: none were).

    `changes` {node: {parameter: value}} and the force `table` are other than recorded, `parameters` those of
    the nodes; `folder` is where it was written.
    """

    changes: Parameters
    table: str
    given: ReplayInput
    parameters: Parameters
    replayed: Replayed
    agreement: Agreement | None
    folder: RunFolder | None = None

    @property
    def recording(self) -> Path | None:
        """The recording of the replay, None where none was written."""
        return self.folder.recording if self.folder else None

    @property
    def held(self) -> bool:
        """Whether the answers are those recorded; true where something was changed or nothing compared."""
        return bool(self.changes or self.table) or self.agreement is None or self.agreement.agrees

    @property
    def samples(self) -> int:
        """How many samples mount_control answered."""
        return sum(len(run.stamps) for run in self.replayed.runs)

    @property
    def figures(self) -> dict[str, Any]:
        """The figures; times in s on the recording's time axis, unknown is None."""
        given, runs, found = self.given, self.replayed.runs, self.agreement
        now, before = replayed_switching(given, self.replayed), recorded_switching(given)
        duration = self.samples * given.sample_time
        return {
            'source': given.source,
            'recording': str(self.recording) if self.folder else None,
            'mode': CORE,
            'changed': {node: dict(values) for node, values in self.changes.items()},
            'samples': self.samples,
            'duration_s': duration,
            'activations': len(runs),
            'initialisations': len(self.replayed.ramps),
            'bridged_samples': sum(run.counts.bridged for run in runs),
            'restarts': sum(run.counts.restarts for run in runs),
            'invalid_samples': sum(run.counts.invalid for run in runs),
            'equal_to_recorded': None if found is None else found.equal,
            'recorded_with': version_differences(given.session, versions()),
            'compared_setpoints': 0 if found is None else found.setpoints.samples,
            'differing_setpoints': None if found is None else found.setpoints.differing,
            'first_difference': moment_figures(found.setpoints.first if found else None),
            'largest_difference': moment_figures(found.setpoints.largest if found else None),
            'differing_intermediates': {
                each.signal: each.differing
                for each in (found.intermediates if found else ())
                if each.differing
            },
            'switch_on_s': list(now.on),
            'switch_off_s': list(now.off),
            'recorded_switch_on_s': list(before.on) if before else None,
            'recorded_switch_off_s': list(before.off) if before else None,
            'switching_changes': switching_changes(before, now, given.sample_time) if before else [],
            'peak_current_a': max((float(np.max(run.setpoints)) for run in runs), default=None),
            'recorded_peak_current_a': _recorded_peak(given),
            'real_time_factor': duration / self.replayed.control_time,
            'notes': list(given.notes),
        }

    def rows(self) -> list[tuple[str, str]]:
        """Return the printed summary: rows of a name, empty where it continues, and a sentence."""
        figures, switched = self.figures, 'every switching at the same sample'
        rows = [
            ('replayed', _counted(figures)),
            ('settings', self._settings()),
            *_named('setpoints', self._verdict()),
            ('versions', versions_sentence(figures['recorded_with'], versions())),
            ('damping switched', replayed_switching(self.given, self.replayed).sentence()),
        ]
        if figures['recorded_switch_on_s'] is not None:
            changes = figures['switching_changes']
            more = [f'and {len(changes) - SHOWN} more'] if len(changes) > SHOWN else []
            differ = [f'{len(changes)} switchings differ', *changes[:SHOWN], *more]
            rows += _named('against the recording', differ if changes else [switched])
        rows.append(('peak current', _peaks(figures)))
        rows.append(('speed', f'{figures["real_time_factor"]:.0f} x real time, without reading the file'))
        return rows

    def sentences(self) -> list[str]:
        """Return the printed summary and the notes, a line each."""
        return [*(f'{name:<22} {text}' for name, text in self.rows()), *self.given.notes]

    def _settings(self) -> str:
        changes = []
        for node, values in self.changes.items():
            recorded = self.given.parameters.get(node, {})
            for name, value in values.items():
                before = f' (recorded {recorded[name]})' if name in recorded else ''
                changes.append(f'{node}.{name} = {value}{before}')
        if self.table:
            changes.append(f'table of {self.table}')
        return 'as recorded' + (f' but {", ".join(changes)}' if changes else '')

    def _verdict(self) -> list[str]:
        found = self.agreement
        if found is None:
            return ['nothing recorded to compare with']
        sentences = found.sentences
        if found.settling_skipped:
            sentences.append(
                f'not compared: the first {SETTLING:g} s ({found.settling_skipped} setpoints), see the '
                f'notes; then up to {1e6 * SETTLED:g} uA apart is as near as it can be'
            )
        return sentences + [run.refusal for run in self.replayed.runs if run.refusal]


def replay(
    recording: str | os.PathLike[str],
    changes: Mapping[str, Any] | None = None,
    *,
    table: str = '',
    mount: str = '',
    out: str | os.PathLike[str] | None = None,
) -> Replay:
    """Replay a recording or run and compare its answers with those recorded, to the bit.

    `changes` are parameters other than recorded, {`name` or `node.name`: value} or {node: {name: value}}, a
    name alone one of mount_control. `table` is `default` or a recording whose force table is used,
    `mount` which of several is replayed. With a folder `out` the replay is written as a recording that can be
    replayed again. Raises a `ValueError` with the reason.
    """
    changed = parsed_changes(changes or {})
    given = _recorded_input(open_mount(Path(recording), mount), table)
    refuse_other_rate(given.parameters, changed)
    if 'mount_init' in changed and len(given.controls) == len(given.parts):
        raise ReplayError('there is no initialisation to replay, so parameters of mount_init change nothing')
    parameters = with_changes(given.parameters, changed)
    check_parameters(parameters)
    given.changes = without(given.changes, changed.get('mount_control', {}))
    given.notes += change_notes(given)
    load_compiled_law(chosen_control(parameters))  # once in a process, not to be counted
    chosen_specimen(parameters)
    replayed = replay_in_core(given, parameters)
    found = agreement(given, replayed)
    result = Replay(changed, table, given, parameters, replayed, found)
    if out is not None:
        result.folder = make_run_folder(Path(out), '')
        result.folder.logs.rmdir()
        write_replay(result.folder.recording, given, replayed, _session(result))
    return result


def parsed_changes(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of {`name` or `node.name`: value}, in the types of the nodes.

    Raises `ParameterError`, also for a node that takes no part in a replay.
    """
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        flat |= (
            {f'{name}.{own}': each for own, each in value.items()}
            if isinstance(value, Mapping)
            else {name: value}
        )
    changes: dict[str, dict[str, Any]] = {}
    for name, value in flat.items():
        node, parameter = owned(name)
        if node in defaults_of_nodes() and node not in REPLAYED_NODES:
            raise ParameterError(
                f'{node} takes no part in a replay; what can be changed are parameters of '
                f'{" and ".join(REPLAYED_NODES)}'
            )
        changes.setdefault(node, {})[parameter] = value
    return checked_settings(changes)


def check_parameters(parameters: Parameters) -> None:
    """Refuse what a node would refuse, before one is started; raises a `ValueError`."""
    control = parameters.get('mount_control', {})
    check_policy(parameters)
    with_flattened(FrictionCoefficients(), control, 'friction')
    with_flattened(FrictionContact(), control, 'contact')
    with_flattened(InitParameters(), parameters.get('mount_init', {}))


def refuse_other_rate(recorded: Parameters, changes: Parameters) -> None:
    """Raise `ReplayError` for another sample rate than the recorded one."""
    rate = control_parameters(recorded).sample_rate
    for node, values in changes.items():
        if values.get('sample_rate', rate) != rate:
            raise ReplayError(
                f'{node}.sample_rate ({values["sample_rate"]:g} Hz) must be that of the recording '
                f'({rate:g} Hz): its samples were taken once; drive anew with --sample-rate'
            )


def with_changes(recorded: Parameters, changes: Parameters) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes that replay, changed.

    With another `parameters_file` the recorded friction goes: it may be that of the file before. Raises
    `ParameterError` for a change that has no effect with the policy.
    """
    own = changes.get('mount_control', {})
    check_effect(own, control_parameters(recorded).policy)
    parameters = {node: dict(recorded.get(node, {})) for node in REPLAYED_NODES}
    if 'parameters_file' in own:
        control = parameters['mount_control']
        for name in [name for name in control if name.startswith(('friction.', 'contact.'))]:
            del control[name]
    return {node: {**values, **changes.get(node, {})} for node, values in parameters.items()}


def change_notes(given: ReplayInput) -> list[str]:
    """Return a sentence for each change of parameters while the recording ran."""
    return [
        f'{change.node} was told {name} = {value} at {(change.time - given.zero) / 1e9:.3f} s; '
        'the replay does the same'
        for change in given.changes
        for name, value in change.values.items()
    ]


def _recorded_input(recording: Recording, table: str) -> ReplayInput:
    """Return what a recording of this project gives to replay, with the gap that `table` names."""
    try:
        imported = session_content(recorded_session(recording)).get('scenario') == SCENARIO
    except SessionError:
        imported = False
    table = table or (DEFAULT_TABLE if imported else '')  # in foreign files no gap was ever measured
    gap, sentence = chosen_gap(table) if table else (None, '')
    given = replay_input(recording, gap)
    given.notes += [*([sentence] if sentence else []), *recording.warnings]
    return given


def _session(done: Replay) -> dict[str, Any]:
    """Return the session of the recording of a replay."""
    given = done.given
    own = {node: dict(values) for node, values in done.parameters.items()}
    return {
        'scenario': 'replay',
        **given.session,
        'parameters': {**session_parameters(given.session), **own},
        'replay': {
            'of': given.source,
            'mode': CORE,
            'made': time_text(),
            'changed': {node: dict(values) for node, values in done.changes.items()},
            'table': done.table and Path(done.table).name,
            'notes': list(given.notes),
            'versions': versions(),
        },
    }


# Figures and sentences.


def _named(name: str, sentences: Iterable[str]) -> list[tuple[str, str]]:
    """Return a row for each sentence, the first with the name."""
    return [('' if place else name, sentence) for place, sentence in enumerate(sentences)]


def _counted(figures: dict[str, Any]) -> str:
    text = f'{figures["samples"]} samples of mount_control ({figures["duration_s"]:.1f} s)'
    words = {
        'activations': 'activation{}',
        'initialisations': 'initialisation{}',
        'bridged_samples': 'sample{} bridged',
        'restarts': 'restart{}',
        'invalid_samples': 'invalid sample{}',
    }
    for name, each in words.items():
        if count := figures[name]:
            text += f', {count} ' + each.format('' if count == 1 else 's')
    return text


def _peaks(figures: dict[str, Any]) -> str:
    now, recorded = figures['peak_current_a'], figures['recorded_peak_current_a']
    text = f'{now:.3f} A'
    return text if recorded in (None, now) else f'{text}, recorded {recorded:.3f} A ({now - recorded:+.3f} A)'


def _recorded_peak(given: ReplayInput) -> float | None:
    if given.answers is None:
        return None
    samples = np.concatenate([run.stamps for run in given.controls])
    currents = given.answers.currents[np.isin(given.answers.stamps, samples)]
    peak = float(np.max(currents)) if len(currents) else math.nan
    return None if math.isnan(peak) else peak
