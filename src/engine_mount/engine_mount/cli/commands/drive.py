"""`engine-mount drive`: the simulated car through the whole graph."""

from typing import TYPE_CHECKING, Annotated

import typer

from engine_mount.cli.commands.options import (
    Columns,
    Dbc,
    Decimal,
    Delimiter,
    Domain,
    JsonFile,
    MapFile,
    Namespace,
    NewFolder,
    Rate,
    Settings,
    Snapshot,
    Split,
    TimeColumn,
    stated,
)
from engine_mount.cli.commands.road_arguments import (
    ContactLength,
    Distance,
    Lateral,
    Repeat,
    SpeedText,
    brought_road,
    check_scenario,
    given_without_road,
    height_column,
)
from engine_mount.cli.completion import faults, listed, named
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import note, terminal
from mount_bringup.graph.nodes import RESTART_LIMIT

if TYPE_CHECKING:
    from engine_mount.drives.brought import Brought

EPILOG = """Exit code: 0 when the drive came to its end with nothing lost, no sample without a setpoint while
control was active, control active when the excitation began (0.5 s later at most), no fault, and the
recording whole; 1 when one of these did not hold, or nothing was driven, with the reason; 2 for a wrong
use of the command; 130 when interrupted.

Times are in s from the first displacement sample, as in `report`, `cut` and `compare`.

Examples:

`engine-mount drive` - a gap in the motorway, in real time

`engine-mount drive --scenario bench --lockstep --duration 10` - 8 Hz, 1 mm, as fast as it goes

`engine-mount drive --scenario sweep --mount hydro --core` - 1 to 50 Hz, the original hydromount in the seat

`engine-mount drive --scenario recorded --file drive.csv --column az:g --scale -1` - your own recording

`engine-mount drive --road blocks.crg --speed 60/3.6 --core` - a measured road: height over distance

`engine-mount drive --split 500MB --split 60s` - in several files; `--snapshot 30s`: events only

`engine-mount drive --fault coil_open@12 --fault lost_5@6:2` - two faults; `--fault list` names all

`engine-mount drive --mounts left,right --fault right/coil_open@12` - one engine on two mounts

`engine-mount drive --set mount_sim.friction.scale=1.15 --set mount_control.policy=switched_viscous`
"""


def drive(
    scenario: Annotated[
        str,
        typer.Option(
            metavar='NAME', help='motorway, bench, sweep, recorded or road', autocompletion=named('scenario')
        ),
    ] = 'motorway',
    mount: Annotated[
        str,
        typer.Option(
            metavar='NAME',
            help='friction, friction_off, friction_always_on, hydro or elastomer; default: friction',
            autocompletion=named('mount'),
        ),
    ] = '',
    mounts: Annotated[
        str,
        typer.Option(
            metavar='NAME,...',
            help='mounts with electronics under one engine: of left, right, front, rear',
            autocompletion=listed('place'),
        ),
    ] = '',
    file: Annotated[
        str, typer.Option(metavar='FILE', help='recorded: any file or folder of signals, or its URI')
    ] = '',
    column: Columns = None,
    time: TimeColumn = '',
    rate: Rate = None,
    map_file: MapFile = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    topic: Annotated[str, typer.Option(help='recorded: topic of a bag, --column being the field')] = '',
    scale: Annotated[
        float | None,
        typer.Option(
            help='recorded: factor to m/s^2 upwards, or on a column with a unit; -1: an axis that points down'
        ),
    ] = None,
    road: Annotated[
        str, typer.Option(metavar='FILE', help='measured road: height over distance, CSV or OpenCRG')
    ] = '',
    speed: SpeedText = '',
    lateral: Lateral = 0.0,
    distance: Distance = '',
    contact_length: ContactLength = None,
    repeat: Repeat = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar='NAME@t[:duration]',
            help='a fault from t s after the start of the simulator on, for so many s or for good; '
            'may be repeated; list: what there is',
            autocompletion=faults,
        ),
    ] = None,
    lockstep: Annotated[
        bool, typer.Option('--lockstep', help='the electronics wait for each answer: deterministic, faster')
    ] = False,
    apart: Annotated[
        bool,
        typer.Option('--apart', help='lock-step: each node in its own process, as in the car; slower'),
    ] = False,
    composed: Annotated[
        bool,
        typer.Option('--composed', help='driver, initialisation and control of the mount share a process'),
    ] = False,
    core: Annotated[bool, typer.Option('--core', help='without middleware: plain function calls')] = False,
    duration: Annotated[
        float | None,
        typer.Option(metavar='S', help='length of the excitation, s; default: the recording, or 15 s'),
    ] = None,
    sample_rate: Annotated[
        float | None,
        typer.Option(metavar='HZ', help='how often the electronics measure, 500 .. 2000 Hz; default: 1000'),
    ] = None,
    seed: Annotated[int | None, typer.Option(help='seed of noise and road')] = None,
    settings: Settings = None,
    out: NewFolder = None,
    json_file: JsonFile = None,
    report: Annotated[
        bool, typer.Option('--report/--no-report', help='draw the picture and write the page about the run')
    ] = True,
    on_full: Annotated[
        str,
        typer.Option(
            metavar='WORD',
            help='full disk: stop the run, or continue without recording',
            autocompletion=named('on_full'),
        ),
    ] = 'stop',
    split: Split = None,
    snapshot: Snapshot = '',
    priority: Annotated[
        int,
        typer.Option(min=0, max=90, help='real-time priority of the 1 kHz loop where permitted; 0: none'),
    ] = 10,
    restarts: Annotated[
        int,
        typer.Option(
            min=0, help='times that a node may be lost within a minute before the drive ends; 0: none'
        ),
    ] = RESTART_LIMIT,
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Drive the simulated car through the whole graph, record it and print what happened."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.drives.drive import DriveOrder, record_drive, recorder_parameters
    from engine_mount.drives.recorder_options import recorder_options
    from engine_mount.reports.drive.results import evaluate_drive, evaluate_snapshots
    from engine_mount.reports.json_file import write_json
    from engine_mount.settings.options import settings_of_options, with_sample_rate
    from mount_bringup.graph.domain import chosen_domain
    from mount_bringup.settings import SettingError, checked_settings
    from mount_sim.mount_choice import with_control_of_mount

    if 'list' in (fault or []):
        _list_faults()
        raise typer.Exit
    if lockstep and core:
        raise typer.BadParameter('choose --lockstep or --core, not both')
    if apart and not lockstep:
        raise typer.BadParameter('--apart goes with --lockstep: in real time every node has its own process')
    if composed and (lockstep or core):
        raise typer.BadParameter('--composed is for real time: in lock-step the nodes share a process anyway')
    of_files = {'time': time, 'rate': rate, 'map-file': map_file, 'dbc': dbc, 'topic': topic, 'scale': scale}
    of_files |= {'decimal': decimal, 'delimiter': delimiter}
    if not file:
        given_without_file(**of_files, column=None if road else column)
    if road:
        check_scenario(scenario, file)
        scenario = 'road'
    else:
        given_without_road(
            speed=speed, lateral=lateral, distance=distance, contact_length=contact_length, repeat=repeat
        )
    try:
        parameters = settings_of_options(settings or [])
    except SettingError as error:
        raise typer.BadParameter(str(error)) from None
    given = {
        'scenario': scenario,
        'mount': mount or None,
        'mounts': mounts or None,
        'seed': seed,
        'timeline.duration': duration,
    }
    sim = parameters.setdefault('mount_sim', {})
    sim.update({name: value for name, value in given.items() if value is not None})
    if fault:
        sim['faults'] = [*sim.get('faults', []), *fault]
    recorder = recorder_options(split or [], snapshot)
    if on_full != 'stop':
        recorder['on_full'] = on_full
    if recorder:
        parameters.setdefault('mount_recorder', {}).update(recorder)
    parameters = with_control_of_mount(with_sample_rate(checked_settings(parameters), sample_rate))
    if core and parameters.get('mount_recorder', {}).get('snapshot'):
        raise typer.BadParameter('--snapshot needs events, which only nodes tell of: not with --core')
    mode = 'core' if core else 'lock-step' if lockstep else 'real time'
    chosen = chosen_domain(domain)
    brought: tuple[Brought, ...] = ()
    console = terminal()
    if road:
        how = {'lateral': lateral, 'column': height_column(column or []), 'distance': distance}
        how |= {'contact_length': contact_length, 'repeat': repeat, 'sim': parameters['mount_sim']}
        brought = (brought_road(road, speed, **how),)
    elif file:
        from engine_mount.drives.recorded_file import recorded_acceleration

        said = [f'{topic}.{name}' if topic else name for name in column or []]
        how = {'time': time, 'rate': rate, 'scale': scale, 'mapping_file': map_file}
        how['stated'] = stated(dbc, decimal, delimiter)
        recorded, factor = recorded_acceleration(str(local(file, console)), said, **how)
        brought = (recorded,)
        parameters['mount_sim']['recorded.scale'] = factor
    order = DriveOrder(
        scenario, mode, parameters, chosen, namespace, out, priority, apart, composed, restarts, brought
    )
    screen = TerminalScreen(console)
    folder, run, complaints = record_drive(order, screen)
    recorder = recorder_parameters(order)
    if recorder.snapshot:
        told = evaluate_snapshots(folder, recorder, run, screen)
    else:
        told = evaluate_drive(folder, parameters, run, screen, report=report)
    complaints += told.complaints
    if json_file is not None:
        write_json(told.figures, json_file)
    for figure in told.pictures:
        console.print(f'figure     {figure}', soft_wrap=True)
    if folder.report.exists():
        console.print(f'report     {folder.report}', soft_wrap=True)
    for place in told.recordings:
        console.print(f'recording  {place}', soft_wrap=True)
    for complaint in complaints:
        note(console, complaint)
    if complaints:
        raise typer.Exit(1)


def given_without_file(**options: object) -> None:
    """Refuse options that say something of a recording where there is none."""
    for name, value in options.items():
        if value not in (None, '', []):
            raise typer.BadParameter(f'--{name} is for a recording: name it with --file FILE')


def _list_faults() -> None:
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.screen import Table
    from mount_sim.electronics.faults.kinds import FAULTS

    rows = [(name, kind.meaning) for name, kind in FAULTS.items()]
    TerminalScreen(terminal()).table(Table('', 'll', rows, ('name', 'fault')))
