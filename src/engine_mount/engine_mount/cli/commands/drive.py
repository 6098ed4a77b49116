"""`engine-mount drive`: the simulated car through the whole graph."""

from typing import Annotated

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
    given_without_road,
    height_column,
    road_excitation,
)
from engine_mount.cli.completion import faults, listed, named
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import note, terminal
from mount_bringup.graph.nodes import RESTART_LIMIT

EPILOG = """Exit code: 0 when the drive came to its end with nothing lost, no sample without a setpoint while
control was active, control active when the excitation began (0.5 s later at most), no fault, and the
recording whole; 1 when one of these did not hold, or nothing was driven, with the reason; 2 for a wrong
use of the command; 130 when interrupted.

Times are in s from the first displacement sample, as in `report`, `cut` and `compare`.

Examples:

`engine-mount drive` - a gap in the motorway, in real time

`engine-mount drive --scenario bench --lockstep --duration 10` - 8 Hz, 1 mm, as fast as it goes

`engine-mount drive --scenario sweep --mount hydro --core` - 1 to 50 Hz, the original hydromount in the seat

`engine-mount drive --file drive.csv --column az:g --scale -1` - your own recording

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
            metavar='NAME',
            help='motorway, bench, sweep, recorded or road; default: that of a file, or motorway',
            autocompletion=named('scenario'),
        ),
    ] = '',
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
    from engine_mount.drives.drive import CombinationError
    from engine_mount.drives.drive import drive as run_drive
    from engine_mount.reports.drive.telling import tell_drive, tell_snapshots
    from engine_mount.reports.json_file import write_json
    from engine_mount.settings.amounts import checked_recorder, recorder_options
    from engine_mount.settings.options import settings_of_options
    from mount_bringup.settings import SettingError

    if 'list' in (fault or []):
        _list_faults()
        raise typer.Exit
    of_files = {'time': time, 'rate': rate, 'map-file': map_file, 'dbc': dbc, 'topic': topic, 'scale': scale}
    of_files |= {'decimal': decimal, 'delimiter': delimiter}
    if not file:
        given_without_file(**of_files, column=None if road else column)
    of_roads = {'lateral': lateral, 'distance': distance, 'contact_length': contact_length, 'repeat': repeat}
    if not road:
        given_without_road(speed=speed, **of_roads)
    elif file:
        raise typer.BadParameter('--road is a scenario of its own; leave out --file')
    try:
        parameters = settings_of_options(settings or [])
    except SettingError as error:
        raise typer.BadParameter(str(error)) from None
    recorder = recorder_options(split or [], snapshot)
    if on_full != 'stop':
        recorder['on_full'] = on_full
    parameters['mount_recorder'] = {**parameters.get('mount_recorder', {}), **recorder}
    console = terminal()
    excitation = None
    if road:
        length = duration or parameters.get('mount_sim', {}).get('timeline.duration', 0.0)
        excitation = road_excitation(road, speed, height_column(column or []), length, **of_roads)
    elif file:
        from engine_mount.drives.external_excitation import recorded_acceleration

        columns = [f'{topic}.{name}' if topic else name for name in column or []]
        excitation = recorded_acceleration(
            str(local(file, console)), columns, time=time, rate=rate, scale=scale, mapping_file=map_file,
            stated=stated(dbc, decimal, delimiter),
        )  # fmt: skip
    screen = TerminalScreen(console)
    try:
        driven = run_drive(
            core=core, lockstep=lockstep, apart=apart, composed=composed, scenario=scenario, mount=mount,
            mounts=mounts, duration=duration, sample_rate=sample_rate, seed=seed, faults=fault or (),
            parameters=parameters, excitation=excitation, out=out, domain=domain, namespace=namespace,
            priority=priority, restarts=restarts, screen=screen,
        )  # fmt: skip
    except CombinationError as error:
        raise typer.BadParameter(str(error)) from None
    recorded = checked_recorder(driven.parameters.get('mount_recorder', {}))
    if recorded.snapshot:
        told = tell_snapshots(driven.folder, recorded, driven.figures, screen)
    else:
        told = tell_drive(driven.folder, driven.parameters, driven.figures, screen, report=report)
    if json_file is not None:
        write_json(told.figures, json_file)
    for figure in told.pictures:
        console.print(f'figure     {figure}', soft_wrap=True)
    if driven.folder.report.exists():
        console.print(f'report     {driven.folder.report}', soft_wrap=True)
    for place in told.recordings:
        console.print(f'recording  {place}', soft_wrap=True)
    complaints = [*driven.complaints, *told.complaints]
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
