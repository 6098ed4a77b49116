"""`engine-mount drive`: the simulated car through the whole graph."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    GRAPH,
    OUTPUT,
    Columns,
    Dbc,
    Decimal,
    Delimiter,
    Distance,
    Domain,
    JsonFile,
    Lateral,
    MapFile,
    Namespace,
    NewFolder,
    Priority,
    Rate,
    Scale,
    Settings,
    SpeedText,
    Split,
    TimeColumn,
    changes_of,
    flag,
    new_screen,
    option,
    refuse_without,
    stated,
    write_figures,
)
from engine_mount.cli.fetching import local
from engine_mount.cli.help import named
from mount_bringup.graph.nodes import RESTART_LIMIT

EPILOG = """Exit code: 0 when the drive came to its end with nothing lost, no sample without a setpoint while
control was active, control active when the excitation began (0.5 s later at most), no fault, and the
recording whole; 1 when one of these did not hold, with the reason; 2 for a wrong use of the command:
nothing was driven; 130 when interrupted, with the path of the recording.

Times are in s from the first displacement sample, as in `report`, `cut` and `compare`.

Examples:

`engine-mount drive` - a gap in the motorway, in real time

`engine-mount drive --scenario bench --lockstep --duration 10` - 8 Hz, 1 mm, as fast as possible

`engine-mount drive --scenario sweep --mount hydro --core` - 1 to 50 Hz, the original hydromount instead

`engine-mount drive --file drive.csv --column az:g --scale -1` - your own recording

`engine-mount drive --road blocks.crg --speed 60/3.6 --core` - a measured road: height over distance

`engine-mount drive --split 500MB` - in several files

`engine-mount drive --fault coil_open@12 --fault lost_5@6:2` - two faults; `--fault list` names all

`engine-mount drive --mounts left,right --fault right/coil_open@12` - one engine on two mounts

`engine-mount drive --set mount_sim.friction.scale=1.15 --set mount_control.policy=switched_viscous`
"""


def drive(
    scenario: Annotated[
        str,
        option(
            'motorway, bench, sweep, recorded or road; default: that of a file, or motorway',
            'NAME',
            named('scenario'),
        ),
    ] = '',
    mount: Annotated[
        str,
        option(
            'friction, friction_off, friction_always_on, hydro or elastomer; default: friction',
            'NAME',
            named('mount'),
        ),
    ] = '',
    mounts: Annotated[
        str,
        option(
            'mounts with electronics under one engine: of left, right, front, rear',
            'NAME,...',
            named('place'),
        ),
    ] = '',
    file: Annotated[str, option('recorded: any file or folder of signals, or its URI', 'FILE')] = '',
    column: Columns = None,
    time: TimeColumn = '',
    rate: Rate = None,
    map_file: MapFile = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    scale: Scale = None,
    road: Annotated[str, option('road: height over distance, a table or OpenCRG', 'FILE')] = '',
    lateral: Lateral = 0.0,
    speed: SpeedText = '',
    distance: Distance = '',
    contact_length: Annotated[
        float | None,
        option('road: contact length of the tyre; default: 0.1', 'M', least=0.0, most=0.5),
    ] = None,
    repeat: Annotated[bool, flag('--repeat', 'road: drive it forth and back until the end')] = False,
    fault: Annotated[
        list[str] | None,
        option(
            'a fault from t s after the start of the simulator on, for so many s or permanently; may '
            'be repeated; list: all names',
            'NAME@t[:duration]',
            named('fault'),
        ),
    ] = None,
    lockstep: Annotated[
        bool, flag('--lockstep', 'the electronics wait for each answer: deterministic, faster', GRAPH)
    ] = False,
    apart: Annotated[
        bool, flag('--apart', 'lock-step: each node in its own process, as in the car; slower', GRAPH)
    ] = False,
    composed: Annotated[
        bool, flag('--composed', 'driver, initialisation and control of the mount share a process', GRAPH)
    ] = False,
    core: Annotated[bool, flag('--core', 'without middleware: plain function calls', GRAPH)] = False,
    duration: Annotated[
        float | None, option('length of the excitation, s; default: the recording, or 15 s', 'S')
    ] = None,
    sample_rate: Annotated[
        float | None,
        option('sample rate of the electronics, 500 .. 2000 Hz; default: 1000', 'HZ', panel=GRAPH),
    ] = None,
    seed: Annotated[int | None, option('seed of noise and road')] = None,
    settings: Settings = None,
    out: NewFolder = None,
    json_file: JsonFile = None,
    report: Annotated[
        bool,
        typer.Option(
            '--report/--no-report',
            help='draw the picture and write the page about the run',
            rich_help_panel=OUTPUT,
        ),
    ] = True,
    split: Split = '',
    priority: Priority = 10,
    restarts: Annotated[
        int,
        option(
            'times that a node may be lost within a minute before the drive ends; 0: none',
            least=0,
            panel=GRAPH,
        ),
    ] = RESTART_LIMIT,
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Drive the simulated car through the whole graph, record it and print the results."""
    from engine_mount.drives.drive import drive as run_drive
    from engine_mount.drives.drive import report_early_end
    from engine_mount.reports.drive.results import evaluate_drive
    from engine_mount.settings.options import recorder_options

    screen = new_screen()
    if 'list' in (fault or []):
        from engine_mount.recordings.screen import Table
        from mount_sim.electronics.faults import FAULTS

        rows = [(name, kind.meaning) for name, kind in FAULTS.items()]
        screen.table(Table('', 'll', rows, ('name', 'fault')))
        return
    if not file:
        refuse_without(
            'file', 'recording', time=time, rate=rate, map_file=map_file, dbc=dbc, scale=scale,
            decimal=decimal, delimiter=delimiter, column=None if road else column,
        )  # fmt: skip
    if not road:
        refuse_without(
            'road', 'road', speed=speed, lateral=lateral, distance=distance,
            contact_length=contact_length, repeat=repeat,
        )  # fmt: skip
    elif file:
        raise typer.BadParameter('--road is a scenario of its own; leave out --file')
    parameters = changes_of(settings)
    if recorder := recorder_options(split):
        parameters.setdefault('mount_recorder', {}).update(recorder)
    excitation = None
    if road:
        from engine_mount import road as read_road
        from engine_mount.drives.external_excitation import measured_road

        if not speed:
            raise typer.BadParameter('--road needs a speed: --speed 60/3.6 (m/s)')
        if len(column or []) > 1:
            raise typer.BadParameter('--column is given once for a road: the column of its height')
        height = ''.join(column or [])
        found = read_road(road, lateral=lateral, column=height, distance=distance, speed=speed)
        length = float(duration or parameters.get('mount_sim', {}).get('timeline.duration', 0.0))
        excitation = measured_road(found, duration=length, contact_length=contact_length, repeat=repeat)
    elif file:
        from engine_mount.drives.external_excitation import recorded_acceleration

        excitation = recorded_acceleration(
            str(local(file, screen)), column or [], time=time, rate=rate, scale=scale, mapping_file=map_file,
            stated=stated(dbc, decimal, delimiter),
        )  # fmt: skip
    driven = run_drive(
        core=core, lockstep=lockstep, apart=apart, composed=composed, scenario=scenario, mount=mount,
        mounts=mounts, duration=duration, sample_rate=sample_rate, seed=seed, faults=fault or (),
        parameters=parameters, excitation=excitation, out=out, domain=domain, namespace=namespace,
        priority=priority, restarts=restarts, screen=screen,
    )  # fmt: skip
    with report_early_end(driven.folder, screen):
        told = evaluate_drive(driven.folder, driven.parameters, driven.figures, screen, report=report)
    write_figures(told.figures, json_file)
    page = [driven.folder.report] if driven.folder.report.exists() else []
    for word, places in (('figure', told.pictures), ('report', page), ('recording', told.recordings)):
        for place in places:
            screen.say(f'{word:<10} {place}')
    complaints = [*driven.complaints, *told.complaints]
    for complaint in complaints:
        screen.note(complaint)
    if complaints:
        raise typer.Exit(1)
