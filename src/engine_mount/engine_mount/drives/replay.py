"""One replay from the recording to the last figure: in core, or in lock-step with the real nodes."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from engine_mount.drives.agreement import Agreement, agreement
from engine_mount.drives.core import Progress, Replayed, replay_in_core
from engine_mount.drives.inputs.foreign import DEFAULT_TABLE, ForeignOrder, chosen_gap, foreign_input
from engine_mount.drives.inputs.input import ReplayError, ReplayInput, replay_input
from engine_mount.drives.inputs.parameter_changes import without
from engine_mount.drives.other_policy import check_effect
from engine_mount.drives.output import write_replay
from engine_mount.recordings.place import open_mount
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
    session_parameters,
)
from engine_mount.settings.chosen import (
    Parameters,
    check_policy,
    chosen_control,
    chosen_specimen,
    control_parameters,
)
from engine_mount.settings.options import owned
from engine_mount.settings.run_folder import RunFolder, make_run_folder
from engine_mount.signals.importing.provenance import SCENARIO
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.controller import load_compiled_law
from mount_control.policy.registry import DEFAULT
from mount_init.parameters import InitParameters
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.session import time_text
from mount_recorder.versions import versions
from mount_ros import topics

CORE, LOCKSTEP = 'core', 'lock-step'
REPLAYED_NODES = ('mount_control', 'mount_init')


@dataclass(frozen=True)
class ReplayOrder:
    """What the user orders; `changes` are parameters other than those recorded, {node: {parameter: value}}.

    `table` is `default` or the path of a recording whose force table is taken, empty for the recorded one.
    `mount` is which of several mounts is replayed.
    """

    recording: Path
    mode: str = CORE
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    table: str = ''
    foreign: ForeignOrder | None = None
    out: Path | None = None
    domain: int = 0
    mount: str = ''


@dataclass
class ReplayOutcome:
    """What came of it.

    `reading_time` (s) is that from the closed file to the displacement in memory as numbers, `decoding_time`
    (s) the part of it from the messages in memory; 0 for a foreign recording, where it is not told apart.
    """

    order: ReplayOrder
    given: ReplayInput
    parameters: Parameters
    replayed: Replayed
    agreement: Agreement | None
    reading_time: float
    decoding_time: float = 0.0
    folder: RunFolder | None = None

    @property
    def as_recorded(self) -> bool:
        """Whether nothing was changed, so that the answers should be those recorded."""
        return not self.order.changes and not self.order.table and self.order.foreign is None

    @property
    def computing_time(self) -> float:
        """Seconds from the messages of displacement in memory to the last answer of the controller.

        In lock-step from the start of the node, which decodes them itself.
        """
        decoding = self.decoding_time if self.order.mode == CORE else 0.0
        return decoding + self.replayed.control_time

    @property
    def held(self) -> bool:
        """Whether the replay gave what it promises: the recorded answers, where nothing was changed."""
        return not self.as_recorded or self.agreement is None or self.agreement.agrees


def replay(order: ReplayOrder, progress: Progress = lambda share: None) -> ReplayOutcome:
    """Replay, compare and write a recording; raises a `ValueError` with the reason."""
    outcome = replay_without_output(order, progress)
    outcome.folder = make_run_folder(order.out, f'replay_{order.mode}')
    outcome.folder.logs.rmdir()
    write_replay(outcome.folder.recording, outcome.given, outcome.replayed, _session(outcome.order, outcome))
    return outcome


def replay_without_output(order: ReplayOrder, progress: Progress = lambda share: None) -> ReplayOutcome:
    """Replay and compare."""
    given, reading_time, decoding_time = _read(order)
    parameters = _changed(given, order)
    check_parameters(parameters)
    given.changes = without(given.changes, order.changes.get('mount_control', {}))
    given.notes += _told(given, order.mode)
    if order.mode == LOCKSTEP:
        from engine_mount.drives.lockstep import replay_in_lockstep  # needs the middleware

        replayed = replay_in_lockstep(given, parameters, order.domain, progress)
    else:
        _load_compiled_run(given, parameters)
        replayed = replay_in_core(given, parameters)
    return ReplayOutcome(
        order, given, parameters, replayed, agreement(given, replayed), reading_time, decoding_time
    )


def _told(given: ReplayInput, mode: str) -> list[str]:
    """Return a sentence for each change of parameters while the recording ran."""
    done = 'the replay does the same' if mode == CORE else 'a replay in lock-step does not: use core'
    return [
        f'{change.node} was told {name} = {value} at {(change.time - given.zero) / 1e9:.3f} s; {done}'
        for change in given.changes
        for name, value in change.values.items()
    ]


def check_parameters(parameters: Parameters) -> None:
    """Refuse what a node would refuse, before one is started; raises a `ValueError`."""
    control = parameters.get('mount_control', {})
    check_policy(parameters)
    with_flattened(FrictionCoefficients(), control, 'friction')
    with_flattened(FrictionContact(), control, 'contact')
    with_flattened(InitParameters(), parameters.get('mount_init', {}))


def parsed_changes(settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of {`name` or `node.name`: value}, in the types of the nodes.

    Raises `ParameterError`, also for a node that takes no part in a replay.
    """
    changes: dict[str, dict[str, Any]] = {}
    for name, value in settings.items():
        node, parameter = owned(name)
        if node in defaults_of_nodes() and node not in REPLAYED_NODES:
            raise ParameterError(
                f'{node} takes no part in a replay; what can be changed are parameters of '
                f'{" and ".join(REPLAYED_NODES)}'
            )
        changes.setdefault(node, {})[parameter] = value
    return checked_settings(changes)


# Reading.


def _read(order: ReplayOrder) -> tuple[ReplayInput, float, float]:
    """Return the input and the times (s) of reading and of decoding the displacement."""
    if order.foreign is not None:
        begin = time.perf_counter()
        parameters = {node: dict(order.changes.get(node, {})) for node in REPLAYED_NODES}
        parameters['mount_control'].setdefault('policy', DEFAULT)
        check_parameters(parameters)
        gap, sentence = chosen_gap(order.table, parameters)
        given = foreign_input(order.recording, order.foreign, parameters, gap)
        given.notes.insert(0, sentence)
        return given, time.perf_counter() - begin, 0.0
    begin = time.perf_counter()
    recording = open_mount(order.recording, order.mount)
    decoding_time = _load_displacement(recording)
    reading_time = time.perf_counter() - begin
    table = order.table or (DEFAULT_TABLE if _is_imported(recording) else '')
    gap, sentence = chosen_gap(table, {}) if table else (None, '')
    given = replay_input(recording, gap)
    given.notes += [*([sentence] if sentence else []), *recording.warnings]
    return given, reading_time, decoding_time


def _is_imported(recording: Recording) -> bool:
    """Whether a recording was made of files of others, in which no gap was ever measured."""
    try:
        return session_content(recorded_session(recording)).get('scenario') == SCENARIO
    except SessionError:
        return False


def _load_displacement(recording: Recording) -> float:
    """Bring stamps and numbers into memory; return the time (s) from messages in memory to numbers."""
    if topics.DISPLACEMENT.name not in recording:
        return 0.0
    series = recording[topics.DISPLACEMENT.name]
    begin = time.perf_counter()
    if len(series):
        assert len(series.stamps) == len(series[topics.DISPLACEMENT.names[0]])
    return time.perf_counter() - begin


def _changed(given: ReplayInput, order: ReplayOrder) -> dict[str, dict[str, Any]]:
    changes = order.changes
    if order.foreign is None:
        refuse_other_rate(given.parameters, changes)
    if 'mount_init' in changes and not any(part not in given.controls for part in given.parts):
        raise ReplayError('there is no initialisation to replay, so parameters of mount_init change nothing')
    return with_changes(given.parameters, changes)


def refuse_other_rate(recorded: Parameters, changes: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise `ReplayError` for another sample rate than the recorded one."""
    rate = control_parameters(recorded).sample_rate
    for node, values in changes.items():
        if values.get('sample_rate', rate) != rate:
            raise ReplayError(
                f'{node}.sample_rate ({values["sample_rate"]:g} Hz) must be that of the recording '
                f'({rate:g} Hz): its samples were taken once; drive anew with --sample-rate'
            )


def with_changes(
    recorded: Mapping[str, Mapping[str, Any]], changes: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes that replay, changed.

    With another `parameters_file` the recorded friction goes: it may be that of the file before. Raises
    `ParameterError` for a change that has no effect with the policy.
    """
    check_effect(changes.get('mount_control', {}), control_parameters(recorded).policy)
    parameters = {node: dict(recorded.get(node, {})) for node in REPLAYED_NODES}
    if 'parameters_file' in changes.get('mount_control', {}):
        control = parameters['mount_control']
        parameters['mount_control'] = {
            name: value for name, value in control.items() if not name.startswith(('friction.', 'contact.'))
        }
    return {node: {**values, **changes.get(node, {})} for node, values in parameters.items()}


def _load_compiled_run(given: ReplayInput, parameters: Parameters) -> None:
    """Load or compile the laws, which a process does once."""
    load_compiled_law(chosen_control(parameters))
    chosen_specimen(parameters)


# The session of the replay's own recording.


def _session(order: ReplayOrder, outcome: ReplayOutcome) -> dict[str, Any]:
    given = outcome.given
    return {
        'scenario': 'replay',
        **given.session,
        'parameters': {
            **session_parameters(given.session),
            **{node: dict(values) for node, values in outcome.parameters.items()},
        },
        'replay': {
            'of': given.source,
            'mode': order.mode,
            'made': time_text(),
            'changed': {node: dict(values) for node, values in order.changes.items()},
            'table': order.table and Path(order.table).name,
            'notes': list(given.notes),
            'versions': versions(),
        },
    }
