"""One simulated drive from the first node to the last figure."""

import contextlib
import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from mount_bags.audit import audit
from mount_bags.audit_report import as_table, sentences
from mount_bags.losses import losses
from mount_bags.reading import Recording, open_recording
from mount_bags.recorder_parameters import RecorderParameters, split_of
from mount_bags.snapshot import saved_snapshots
from mount_bringup.core.chain import Parameters, control_parameters
from mount_bringup.core.recording import record_core
from mount_bringup.domain import domain_lock
from mount_bringup.ending_signals import ending_signals
from mount_bringup.evaluation import Drive, load_drive, samples_at_the_ends
from mount_bringup.graph.nodes import CONTROL, RECORDER, SIM, SIMULATED, GraphSettings
from mount_bringup.graph.supervisor import Supervisor, session_text
from mount_bringup.keyboard import MARK_KEYS, Keyboard
from mount_bringup.preflight import preflight
from mount_bringup.progress_bar import progress_bar
from mount_bringup.run_folder import RunFolder, make_run_folder
from mount_bringup.summary import (
    SUMMARISED,
    print_summary,
    snapshots_sentence,
    summarise,
    summarise_snapshots,
    write_json,
)
from mount_bringup.terminal import note
from mount_bringup.versions import versions
from mount_control.diagnosis import fault_sentence
from mount_models.quantity import with_flattened
from mount_sim.diagnosis import FINISHED, beyond_range_sentence
from mount_sim.excitation import Excitation

# A ROS domain has 250 UDP ports from 7400 on (RTPS 2.2, section 9.6.1.1), of which two for each participant
# are in use. The bus takes one behind them: higher up the kernel gives them to anybody, and the bus would not
# open.
_FIRST_PORT, _PORTS_OF_DOMAIN = 7530, 250  # behind 59 participants
_PLACES = 119  # namespaces told apart by their ports
_SLACK = 30.0  # s: beyond the simulated time, until a run in real time counts as stuck


@dataclass(frozen=True)
class DriveOrder:
    """What the user wants."""

    scenario: str
    mode: str  # 'real time', 'lock-step' or 'core'
    parameters: dict[str, dict[str, Any]]
    domain: int = 0
    namespace: str = ''
    out: Path | None = None
    priority: int = 0
    apart: bool = False  # in lock-step too every node has a process of its own
    report: bool = True  # with a figure and a page about the run


@dataclass
class DriveOutcome:
    """What came of it: figures, recordings, and a sentence for each thing that was not as it should be."""

    figures: dict[str, Any]
    folder: RunFolder
    recordings: list[Path]
    complaints: list[str] = field(default_factory=list)


def drive(order: DriveOrder, console: Console) -> DriveOutcome:
    """Drive, record, evaluate; raises `Interrupted`, `GraphError` or a `ValueError` with the reason."""
    folder, run, complaints = record_drive(order, console)
    if _recorder_parameters(order).snapshot:
        return _tell_snapshots(order, folder, run, complaints, console)
    recording = open_recording(folder.recording)
    complaints += recording.warnings
    drive_data = load_drive(recording, others=SUMMARISED)
    figures = _evaluate(order, folder, recording, drive_data, run, console, complaints)
    if order.report:
        begin = figures['excitation_start_s']
        complaints += _complaint(folder.figure, lambda: _draw(order, folder, drive_data, begin))
        complaints += _complaint(folder.report, lambda: _write_report(folder, recording, console))
    return DriveOutcome(figures, folder, [folder.recording], complaints)


def record_drive(order: DriveOrder, console: Console) -> tuple[RunFolder, dict[str, Any], list[str]]:
    """Drive and record; return the folder, what the run itself knows, and what was not as it should be.

    Raises as `drive` does.
    """
    excitation = preflight(order.parameters)
    for remark in excitation.notes:
        note(console, remark)
    folder = make_run_folder(order.out, order.scenario)
    complaints: list[str] = []
    if order.mode == 'core':
        return folder, _drive_in_core(order, excitation, folder, console, complaints), complaints
    return folder, _drive_graph(order, excitation, folder, console, complaints), complaints


def _tell_snapshots(
    order: DriveOrder, folder: RunFolder, run: dict[str, Any], complaints: list[str], console: Console
) -> DriveOutcome:
    """Say what a run has that recorded only events: its figures would need all of the drive."""
    saved = saved_snapshots(folder.recording)
    for place in saved:
        recording = open_recording(place)
        audits = audit(recording)
        found = losses(recording, audits)
        console.print(f'{place.name}: {sentences(audits, found)[-1]}', soft_wrap=True)
        complaints += [*recording.warnings, *(f'{place.name}: {words}' for words in found.complaints())]
    parameters = _recorder_parameters(order)
    console.print(snapshots_sentence(len(saved), parameters), soft_wrap=True)
    figures = summarise_snapshots(saved, run)
    write_json(figures, folder.summary)
    return DriveOutcome(figures, folder, saved, complaints)


def _recorder_parameters(order: DriveOrder) -> RecorderParameters:
    return with_flattened(RecorderParameters(), order.parameters.get(RECORDER.name, {}))


def _evaluate(
    order: DriveOrder,
    folder: RunFolder,
    recording: Recording,
    drive_data: Drive,
    run: dict[str, Any],
    console: Console,
    complaints: list[str],
) -> dict[str, Any]:
    audits = audit(recording)
    found = losses(recording, audits)
    complaints += [*found.complaints(), *samples_at_the_ends(recording, audits, run['samples'])]
    figures = summarise(recording, audits, found, drive_data, order.parameters, run)
    write_json(figures, folder.summary)
    print_summary(figures, found, console)
    console.print(as_table(audits))
    return figures


def _draw(order: DriveOrder, folder: RunFolder, drive_data: Drive, begin: float) -> None:
    from mount_bringup.figure import draw_drive  # after the drive: what draws takes a second to load

    control = control_parameters(order.parameters)
    title = f'{order.scenario}, {order.mode}: mount displacement and actuator current'
    draw_drive(drive_data, control.switch_on_level, control.switch_off_level, begin, title, folder.figure)


def _write_report(folder: RunFolder, recording: Recording, console: Console) -> None:
    from mount_bringup.report_pages import write_report  # after the drive, as above

    write_report([recording], None, folder.report, None, console)


def _complaint(file: Path, make: Callable[[], None]) -> list[str]:
    """Make the picture or page of a drive; what prevents it is a complaint, for the recording is there."""
    try:
        make()
    except Exception as error:  # whatever it stumbles over
        return [f'{file.name} could not be made: {str(error) or type(error).__name__}']
    return []


def _drive_graph(
    order: DriveOrder, excitation: Excitation, folder: RunFolder, console: Console, complaints: list[str]
) -> dict[str, Any]:
    lockstep = order.mode == 'lock-step'
    settings = GraphSettings(
        namespace=order.namespace,
        domain=order.domain,
        parameters=_node_parameters(order, folder),
        together=_together(order),
        priority=0 if lockstep else order.priority,
    )
    supervisor = Supervisor(SIMULATED, settings, folder.logs)
    with domain_lock(order.domain, order.namespace), ending_signals(supervisor.interrupt):
        try:
            with console.status('starting') as status:
                supervisor.start(
                    lambda all_parameters: _session(order, all_parameters),
                    lambda what: status.update(Text(what)),
                )
            duration = excitation.start + excitation.duration
            limit = math.inf if order.mode == 'lock-step' else duration + _SLACK
            _watch_drive(order, supervisor, limit, console)
            figures = supervisor.figures(SIM)
            complaints += _beyond_range(int(figures['beyond_range']), float(figures['first_beyond_range_s']))
            complaints += _control_faults(int(supervisor.figures(CONTROL).get('faults', 0)))
        finally:
            recorder = supervisor.figures(RECORDER)
            if recorder.get('failed') == 'True' and recorder.get('fatal') != 'True':
                supervisor.notes.append(recorder['sentence'])  # of a fatal one the graph's error tells
            complaints += supervisor.stop()
            for sentence in supervisor.notes:
                note(console, sentence)
    return {
        'scenario': order.scenario,
        'mode': order.mode,
        'samples': int(figures['samples']),
        'excitation_start': float(figures['excitation_start_s']),
        'real_time_factor': float(figures['real_time_factor']),
        'latency_median_s': float(figures['latency_median_s']),
        'latency_p99_s': float(figures['latency_p99_s']),
    }


def _watch_drive(order: DriveOrder, supervisor: Supervisor, limit: float, console: Console) -> None:
    # In lock-step what is seen on the screen tells nothing of the time in the stamps: no keys.
    keyboard = Keyboard() if order.mode == 'real time' else contextlib.nullcontext(None)
    with keyboard as keys, progress_bar(console) as progress:
        set_mark = supervisor.mark_setter(lambda answer: console.print(answer, soft_wrap=True))
        hint = '; m or space: mark' if keys is not None and keys.present else ''
        task = progress.add_task(f'driving ({order.scenario}{hint})', total=1.0)

        def finished() -> bool:
            figures = supervisor.figures(SIM)
            share = int(figures.get('samples', 0)) / int(figures.get('samples_of_run', 1))
            progress.update(task, completed=share)
            for key in keys.wait(0.0) if keys is not None else ():
                if key in MARK_KEYS:
                    set_mark()
            return figures.get('sentence') == FINISHED

        supervisor.wait_until(finished, limit, 'the end of the drive')


def _drive_in_core(
    order: DriveOrder, excitation: Excitation, folder: RunFolder, console: Console, complaints: list[str]
) -> dict[str, Any]:
    with progress_bar(console) as progress:
        task = progress.add_task(f'driving ({order.scenario})', total=1.0)
        outcome = record_core(
            folder.recording,
            order.parameters,
            _session(order, order.parameters),
            lambda share: progress.update(task, completed=share),
            excitation=excitation,
            namespace=order.namespace,
            split=split_of(_recorder_parameters(order)),
        )
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
    }


def _beyond_range(samples: int, first: float) -> list[str]:
    return [beyond_range_sentence(samples, first)] if samples else []


def _control_faults(faults: int) -> list[str]:
    return [fault_sentence(faults)] if faults else []


def _node_parameters(order: DriveOrder, folder: RunFolder) -> dict[str, dict[str, Any]]:
    lockstep = order.mode == 'lock-step'
    can = {'interface': 'virtual' if _together(order) else 'udp_multicast', 'port': _port(order)}
    added: dict[str, dict[str, Any]] = {
        'mount_recorder': {'uri': str(folder.recording)},
        'mount_driver': can,
        'mount_sim': can,
        # Nothing but a stalled process may end a ramp in lock-step.
        'mount_init': {'silence_timeout': 10.0} if lockstep else {},
        'mount_control': {},
    }
    return {
        name: {'lockstep': lockstep, **values, **order.parameters.get(name, {})}
        for name, values in added.items()
    }


def _together(order: DriveOrder) -> bool:
    return order.mode == 'lock-step' and not order.apart


def _port(order: DriveOrder) -> int:
    """Return the UDP port of the CAN bus: one for each domain and namespace."""
    name = order.namespace.strip('/')
    place = 1 + zlib.crc32(name.encode()) % _PLACES if name else 0
    return _FIRST_PORT + _PORTS_OF_DOMAIN * order.domain + place


def _session(order: DriveOrder, parameters: Parameters) -> str:
    return session_text(
        {
            'scenario': order.scenario,
            'mode': order.mode,
            'started': datetime.now().astimezone().isoformat(timespec='seconds'),
            'parameters': {node: dict(values) for node, values in parameters.items()},
            'versions': versions(),
        }
    )
