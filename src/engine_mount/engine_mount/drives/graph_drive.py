"""A drive through the real nodes, in real time or in lock-step."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from engine_mount.drives.events import DriveEvents, line
from engine_mount.drives.external_excitation import FOLDER
from engine_mount.recordings.screen import Screen
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.options import mounts_of, settings_of_mounts
from engine_mount.settings.run_folder import RunFolder
from engine_mount.signals.excitation import with_array
from mount_bringup.graph.domain import can_port, domain_lock
from mount_bringup.graph.graph import GraphObserver
from mount_bringup.graph.nodes import CONTROL, RECORDER, SIM, SIMULATED, GraphSettings, Grouping, of_mounts
from mount_bringup.graph.shutdown import ending_signals
from mount_bringup.graph.supervisor import Supervisor
from mount_ros.messages.verdicts import flags_of
from mount_sim.excitation.excitation import Excitation

_SLACK = 30.0  # s: beyond the simulated time, until a run in real time counts as stuck


def drive_graph(
    settings: GraphSettings,
    excitation: Excitation,
    folder: RunFolder,
    session: Callable[[Parameters], str],
    screen: Screen,
    *,
    lockstep: bool,
) -> tuple[dict[str, Any], list[str]]:
    """Drive; return the figures of the run, and a sentence for each thing that was not as it should be.

    `settings` hold the parameters that the user chose. Raises `Interrupted` or `GraphError`.
    """
    mounts = mounts_of(settings.parameters)
    settings = replace(settings, parameters=_parameters(settings, excitation, folder, lockstep=lockstep))
    supervisor = Supervisor(of_mounts(SIMULATED, mounts), settings, folder.logs)
    supervisor.recovery.report = screen.note
    events = DriveEvents(supervisor.nodes, screen.say)
    supervisor.observer = events
    complaints: list[str] = []
    with domain_lock(settings.domain, settings.namespace, mounts), ending_signals(supervisor.interrupt):
        try:
            events.begin()
            with screen.line(events.states) as show:
                supervisor.start(session, lambda text: show(events.states))
            end = math.inf if lockstep else excitation.start + excitation.duration + _SLACK
            _watch(supervisor, events, end, screen, lockstep=lockstep)
            figures = supervisor.figures(SIM)
            controls = [supervisor.figures(node) for node in supervisor.nodes if node.is_a(CONTROL)]
        finally:
            supervisor.observer = GraphObserver()  # the supervisor reports the end
            recorder = supervisor.figures(RECORDER)
            flags = flags_of(recorder)
            if flags.failed and not flags.fatal:
                supervisor.notes.append(recorder['sentence'])  # a fatal one is the error of the graph
            complaints += supervisor.stop()
            complaints += [restart.sentence for restart in supervisor.recovery.restarts]
            for sentence in supervisor.notes:
                screen.note(sentence)
    return {
        'samples': int(figures['samples']),
        'excitation_start': float(figures['excitation_start_s']),
        'real_time_factor': float(figures['real_time_factor']),
        'latency_median': float(figures['latency_median_s']),
        'latency_p99': float(figures['latency_p99_s']),
        'restarts': supervisor.recovery.restarts,
        'beyond_range': int(figures['beyond_range']),
        'first_beyond_range': float(figures['first_beyond_range_s']),
        'control_faults': sum(int(control.get('faults', 0)) for control in controls),
    }, complaints


def _parameters(
    settings: GraphSettings, excitation: Excitation, folder: RunFolder, *, lockstep: bool
) -> dict[str, dict[str, Any]]:
    """Return the parameters of all nodes; the folder takes the array of the excitation."""
    chosen, mounts = settings.parameters, mounts_of(settings.parameters)
    together = settings.grouping is Grouping.TOGETHER
    interface = 'virtual' if together else 'udp_multicast'
    sim: dict[str, Any] = {}
    completed: dict[str, dict[str, Any]] = {}
    for mount, own in settings_of_mounts(chosen).items():
        port = can_port(settings.domain, f'{settings.namespace}/{mount}')
        bus: dict[str, Any] = {'interface': interface, 'port': port}
        if mount and together:
            bus['channel'] = f'can_{mount}'
        driver = bus | own.get('mount_driver', {})
        # The electronics are on the bus of the driver, also where a user chose it.
        ends = {name: driver[name] for name in ('interface', 'channel', 'port') if name in driver}
        sim['interface'] = ends.pop('interface')
        sim |= {f'mount_{mount}.{name}' if mount else name: value for name, value in ends.items()}
        # Nothing but a stalled process may end a ramp in lock-step.
        init = {'silence_timeout': 10.0} if lockstep else {}
        added = {'mount_driver': bus, 'mount_init': init, 'mount_control': {}}
        completed |= {
            f'{mount}/{node}'.lstrip('/'): {**values, **own.get(node, {})} for node, values in added.items()
        }
    sim |= chosen.get(SIM.name, {})
    completed[SIM.name] = with_array(sim, excitation, folder.path / FOLDER)
    recorder = {'uri': str(folder.recording), **({'mounts': ','.join(mounts)} if mounts else {})}
    completed[RECORDER.name] = {**recorder, **chosen.get(RECORDER.name, {})}
    return {node: {'lockstep': lockstep, **values} for node, values in completed.items()}


def _watch(
    supervisor: Supervisor, events: DriveEvents, limit: float, screen: Screen, *, lockstep: bool
) -> None:
    """Serve the graph to the end of the drive; in real time the screen names the page about it."""
    first = supervisor.figures(SIM)
    scenario = supervisor.settings.parameters[SIM.name]['scenario']
    with screen.bar(f'driving ({scenario})') as show:
        if not lockstep:
            where = f' --domain {supervisor.settings.domain}' if supervisor.settings.domain else ''
            where += f' --namespace {space}' if (space := supervisor.settings.namespace) else ''
            page = f'engine-mount view{where}, then http://127.0.0.1:8137'
            screen.say(line('look', f'in another terminal: {page}'))

        def finished() -> bool:
            show(_share(first, supervisor.figures(SIM)), detail=events.damping)
            return supervisor.finished

        supervisor.wait_until(finished, limit, 'the end of the drive')


def _share(first: Mapping[str, str], now: Mapping[str, str]) -> float:
    """Return the share of the drive that is done, 0 at the report `first`."""
    begin = int(first.get('samples', 0))
    whole = int(now.get('samples_of_run', 1)) - begin
    return min(1.0, max(0.0, (int(now.get('samples', 0)) - begin) / whole)) if whole > 0 else 1.0
