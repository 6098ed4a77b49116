"""One simulated drive, from the first node to the recording."""

import contextlib
import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rclpy.client import Client
from std_srvs.srv import Trigger

from engine_mount.drives.brought import FOLDER, Brought, provenance, written
from engine_mount.drives.happenings import Happenings, line
from engine_mount.drives.keyboard import MARK_KEYS, Keyboard
from engine_mount.drives.loop.recording import record_car, record_core
from engine_mount.drives.preflight import preflight
from engine_mount.drives.progress import DriveProgress
from engine_mount.recordings.screen import Screen
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.mounts import mounts_of, settings_of_mounts
from engine_mount.settings.run_folder import RunFolder, make_run_folder
from engine_mount.signals.excitation import with_array
from mount_bringup.graph.domain import can_port, domain_lock
from mount_bringup.graph.nodes import (
    CONTROL,
    RECORDER,
    RESTART_LIMIT,
    SIM,
    SIMULATED,
    GraphSettings,
    Grouping,
    of_mounts,
)
from mount_bringup.graph.reports import GraphObserver
from mount_bringup.graph.shutdown import ending_signals
from mount_bringup.graph.supervisor import Supervisor
from mount_control.diagnosis import FAULT_SENTENCE
from mount_control.policy.registry import DEFAULT
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.parameters import RecorderParameters, split_of
from mount_recorder.session import new_session, session_text
from mount_ros.messages.verdicts import flags_of
from mount_sim.diagnosis import beyond_range_sentence
from mount_sim.excitation.excitation import Excitation

_SLACK = 30.0  # s: beyond the simulated time, until a run in real time counts as stuck


@dataclass(frozen=True)
class DriveOrder:
    """What the user orders."""

    scenario: str
    mode: str  # 'real time', 'lock-step' or 'core'
    parameters: dict[str, dict[str, Any]]
    domain: int = 0
    namespace: str = ''
    out: Path | None = None
    priority: int = 0
    apart: bool = False  # in lock-step too every node has a process of its own
    composed: bool = False  # in real time driver, initialisation and control share one
    restart_limit: int = RESTART_LIMIT
    brought: tuple[Brought, ...] = ()

    @property
    def mounts(self) -> tuple[str, ...]:
        """The names of the mounts, none where there is one mount alone."""
        return mounts_of(self.parameters)


def record_drive(order: DriveOrder, screen: Screen) -> tuple[RunFolder, dict[str, Any], list[str]]:
    """Drive and record; return the folder, what the run itself knows, and what was not as it should be.

    Raises `Interrupted`, `GraphError` or a `ValueError` with the reason.
    """
    with tempfile.TemporaryDirectory() as scratch:
        tried = written(order.brought, order.parameters, Path(scratch))
        excitation = preflight(tried, core=order.mode == 'core')
    for remark in (*(note for each in order.brought for note in each.notes), *excitation.notes):
        screen.note(remark)
    folder = make_run_folder(order.out, order.scenario)
    order = replace(order, parameters=written(order.brought, order.parameters, folder.path / FOLDER))
    complaints: list[str] = []
    if order.mode == 'core':
        return folder, _drive_in_core(order, excitation, folder, screen, complaints), complaints
    return folder, _drive_graph(order, excitation, folder, screen, complaints), complaints


def recorder_parameters(order: DriveOrder) -> RecorderParameters:
    """Return the parameters of the recorder in a drive."""
    return with_flattened(RecorderParameters(), order.parameters.get(RECORDER.name, {}))


def _drive_graph(
    order: DriveOrder, excitation: Excitation, folder: RunFolder, screen: Screen, complaints: list[str]
) -> dict[str, Any]:
    lockstep = order.mode == 'lock-step'
    settings = GraphSettings(
        namespace=order.namespace,
        domain=order.domain,
        parameters=_node_parameters(order, excitation, folder),
        grouping=_grouping(order),
        priority=0 if lockstep else order.priority,
        restart_limit=order.restart_limit,
    )
    supervisor = Supervisor(of_mounts(SIMULATED, order.mounts), settings, folder.logs)
    supervisor.recovery.report = screen.note
    happenings = Happenings(supervisor.nodes, screen.say)
    supervisor.reports.observer = happenings
    with domain_lock(order.domain, order.namespace, order.mounts), ending_signals(supervisor.interrupt):
        try:
            happenings.begin()
            with screen.line(happenings.states) as show:
                supervisor.start(
                    lambda all_parameters: _session(order, all_parameters),
                    lambda text: show(happenings.states),
                )
            duration = excitation.start + excitation.duration
            limit = math.inf if order.mode == 'lock-step' else duration + _SLACK
            _watch_drive(order, supervisor, happenings, limit, screen)
            figures = supervisor.figures(SIM)
            complaints += _beyond_range(int(figures['beyond_range']), float(figures['first_beyond_range_s']))
            controls = (supervisor.figures(node) for node in supervisor.nodes if node.is_a(CONTROL))
            complaints += _control_faults(sum(int(told.get('faults', 0)) for told in controls))
        finally:
            supervisor.reports.observer = GraphObserver()  # of the end the supervisor tells
            recorder = supervisor.figures(RECORDER)
            flags = flags_of(recorder)
            if flags.failed and not flags.fatal:
                supervisor.notes.append(recorder['sentence'])  # of a fatal one the graph's error tells
            complaints += supervisor.stop()
            complaints += [restart.sentence for restart in supervisor.recovery.restarts]
            for sentence in supervisor.notes:
                screen.note(sentence)
    return {
        'scenario': order.scenario,
        'mode': order.mode,
        'samples': int(figures['samples']),
        'excitation_start': float(figures['excitation_start_s']),
        'real_time_factor': float(figures['real_time_factor']),
        'latency_median_s': float(figures['latency_median_s']),
        'latency_p99_s': float(figures['latency_p99_s']),
        'restarts': supervisor.recovery.restarts,
    }


def _watch_drive(
    order: DriveOrder, supervisor: Supervisor, happenings: Happenings, limit: float, screen: Screen
) -> None:
    # In lock-step what is seen on the screen tells nothing of the time in the stamps: no keys.
    keyboard = Keyboard() if order.mode == 'real time' else contextlib.nullcontext(None)
    with keyboard as keys, screen.bar(f'driving ({order.scenario})') as show:
        if order.mode == 'real time':
            _tell_where_to_look(order, screen, marks=keys is not None and keys.present)
        mark = supervisor.client(Trigger, f'{RECORDER.name}/mark')  # found by the time it is wanted
        progress = DriveProgress(supervisor.figures(SIM), real_time=order.mode == 'real time')

        def finished() -> bool:
            show(progress.share(supervisor.figures(SIM)), detail=happenings.present)
            for key in keys.wait(0.0) if keys is not None else ():
                if key in MARK_KEYS:
                    _set_mark(mark, screen)
            return supervisor.finished

        supervisor.wait_until(finished, limit, 'the end of the drive')


def _set_mark(client: Client, screen: Screen) -> None:
    """Request a mark of the recorder."""

    def answered(call: Any) -> None:
        answer = call.result()
        screen.say('marked' if answer.success else f'no mark was set: {answer.message}')

    if client.service_is_ready():
        client.call_async(Trigger.Request()).add_done_callback(answered)
    else:
        screen.say('no mark was set: the recorder is not there yet')


def _tell_where_to_look(order: DriveOrder, screen: Screen, *, marks: bool) -> None:
    where = f' --domain {order.domain}' if order.domain else ''
    where += f' --namespace {order.namespace}' if order.namespace else ''
    page = f'engine-mount view{where}, then http://127.0.0.1:8137'
    screen.say(line('look', f'in another terminal: {page}'))
    if marks:
        screen.say(line('mark', 'm or space'))


def _drive_in_core(
    order: DriveOrder, excitation: Excitation, folder: RunFolder, screen: Screen, complaints: list[str]
) -> dict[str, Any]:
    with screen.bar(f'driving ({order.scenario})') as show:
        given = {
            'excitation': excitation,
            'namespace': order.namespace,
            'split': split_of(recorder_parameters(order)),
        }
        sessions = {
            name: _session(order, settings) for name, settings in settings_of_mounts(order.parameters).items()
        }
        if order.mounts:
            outcome = record_car(folder.recording, order.parameters, sessions, show, **given)
        else:
            outcome = record_core(folder.recording, order.parameters, sessions[''], show, **given)
    complaints += _beyond_range(outcome.beyond_range.samples, outcome.beyond_range.first)
    complaints += _control_faults(outcome.control_faults)
    return {
        'scenario': order.scenario,
        'mode': order.mode,
        'samples': outcome.samples,
        'excitation_start': outcome.excitation_start,
        'real_time_factor': outcome.simulated / outcome.wall_time,
        'latency_median_s': float('nan'),
        'latency_p99_s': float('nan'),
        'restarts': [],
    }


def _beyond_range(samples: int, first: float) -> list[str]:
    return [beyond_range_sentence(samples, first)] if samples else []


def _control_faults(faults: int) -> list[str]:
    return [f'{FAULT_SENTENCE} (times: {faults})'] if faults else []


def _node_parameters(
    order: DriveOrder, excitation: Excitation, folder: RunFolder
) -> dict[str, dict[str, Any]]:
    lockstep, mounts = order.mode == 'lock-step', order.mounts
    buses = {mount: _bus(order, mount) for mount in mounts or ('',)}
    interface = {'interface': 'virtual' if _grouping(order) is Grouping.TOGETHER else 'udp_multicast'}
    shared: dict[str, dict[str, Any]] = {
        'mount_recorder': {'uri': str(folder.recording), **({'mounts': ','.join(mounts)} if mounts else {})},
        'mount_sim': interface
        | {
            f'mount_{mount}.{name}' if mount else name: value
            for mount, bus in buses.items()
            for name, value in bus.items()
        },
    }
    # Nothing but a stalled process may end a ramp in lock-step.
    patience = {'silence_timeout': 10.0} if lockstep else {}
    added = {name: {**values, **order.parameters.get(name, {})} for name, values in shared.items()}
    added[SIM.name] = with_array(added[SIM.name], excitation, folder.path / FOLDER)
    for mount, settings in settings_of_mounts(order.parameters).items():
        own = {'mount_driver': interface | buses[mount], 'mount_init': patience, 'mount_control': {}}
        for name, values in own.items():
            added[f'{mount}/{name}'.lstrip('/')] = {**values, **settings.get(name, {})}
    return {name: {'lockstep': lockstep, **values} for name, values in added.items()}


def _bus(order: DriveOrder, mount: str) -> dict[str, Any]:
    """Return port, and channel where that must tell buses apart, of the CAN bus of a mount."""
    port: dict[str, Any] = {'port': can_port(order.domain, f'{order.namespace}/{mount}')}
    return {**port, 'channel': f'can_{mount}'} if mount and _grouping(order) is Grouping.TOGETHER else port


def _grouping(order: DriveOrder) -> Grouping:
    if order.composed:
        return Grouping.COMPOSED
    return Grouping.TOGETHER if order.mode == 'lock-step' and not order.apart else Grouping.APART


def _session(order: DriveOrder, parameters: Parameters) -> str:
    told = told_parameters(parameters)
    # the files that the order names, not the array that is made of them
    read = {name: value for name, value in order.parameters.get(SIM.name, {}).items() if _names_input(name)}
    others = {name: value for name, value in told.get(SIM.name, {}).items() if not _names_input(name)}
    told[SIM.name] = {**others, **read}
    content = {'scenario': order.scenario, 'mode': order.mode, 'parameters': told}
    return session_text(new_session({**content, **provenance(order.brought, order.parameters)}))


def _names_input(name: str) -> bool:
    return name.startswith(('recorded.', 'road.'))


def told_parameters(parameters: Parameters) -> dict[str, dict[str, Any]]:
    """Return the parameters as the session of a drive tells them."""
    told = {node: dict(values) for node, values in parameters.items()}
    # where these are not named, a recording is an older one
    told['mount_control'] = {'policy': DEFAULT, 'sample_rate': SAMPLE_RATE, **told.get('mount_control', {})}
    return told
