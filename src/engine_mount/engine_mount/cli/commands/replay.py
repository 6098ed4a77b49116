"""`engine-mount replay`: a recorded displacement through the same controller again."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    RATE,
    Dbc,
    Decimal,
    Delimiter,
    Domain,
    JsonFile,
    MapFile,
    NewFolder,
    TimeColumn,
    flag,
    option,
    recording_argument,
    stated,
)
from engine_mount.cli.commands.other_than_recorded import OtherThanRecorded, changes_of
from engine_mount.cli.completion import named
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import terminal

EPILOG = """Exit code: 0 when the setpoints are those recorded, or something was changed on purpose; 1 when
they are not, or the order was refused.

Examples:

`engine-mount replay bags/first/recording` - equal to what was recorded?

`engine-mount replay RECORDING --lockstep` - the same through the real node over topics

`engine-mount replay RECORDING --set switch_on_level=0.0006 --set damper=viscous_3000` - what if?

`engine-mount replay drive.mcap --map displacement=/suspension/pot.range:mm` - a foreign one

`engine-mount replay RECORDING --live --rate 2` - to look at with rviz, plotjuggler, ros2 topic echo
"""


def replay(
    recording: Annotated[
        str,
        recording_argument(
            instead='folder of a run or recording, MCAP file, or its URI; with --map any file of signals'
        ),
    ],
    core: Annotated[bool, flag('--core', 'through the controller as function calls; the default')] = False,
    lockstep: Annotated[
        bool, flag('--lockstep', 'control through its real node over topics, sample by sample')
    ] = False,
    live: Annotated[
        bool, flag('--live', 'publish the recorded topics by the wall clock, to look at')
    ] = False,
    settings: OtherThanRecorded = None,
    table: Annotated[str, option('current-force table of another RECORDING, or "default": calculated')] = '',
    maps: Annotated[
        list[str] | None,
        typer.Option(
            '--map',
            metavar='NAME=COLUMN[:UNIT]',
            help='foreign recording: displacement, or engine_displacement and chassis_displacement; of a '
            'bag the column is /topic.field',
        ),
    ] = None,
    map_file: MapFile = None,
    time: TimeColumn = '',
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    scale: Annotated[
        float | None, option('foreign recording: factor to m, or on what --map names with a unit')
    ] = None,
    offset: Annotated[
        str,
        option(
            'foreign recording: what is subtracted, in m, or mean; default: that of --map-file, or mean', 'M'
        ),
    ] = '',
    out: NewFolder = None,
    json_file: JsonFile = None,
    mount: Annotated[str, option('which of several mounts, such as left', 'NAME', named('place'))] = '',
    rate: Annotated[float | None, option(f'live: factor on the speed of time; {RATE}')] = None,
    start: Annotated[float, typer.Option('--from', metavar='S', help='live: where to begin, s')] = 0.0,
    with_control: Annotated[
        bool, flag('--with-control', 'live: mount_control answers, not the recording')
    ] = False,
    domain: Domain = None,
    namespace: Annotated[str, option('live: namespace of the published topics')] = '',
) -> None:
    """Replay a recorded displacement through the same controller and tell whether its answers are the same.

    Equal is to the last bit; parameters and tables can be other than recorded.
    """
    if core + lockstep + live > 1:
        raise typer.BadParameter('choose one of --core, --lockstep and --live')
    console = terminal()
    changes = changes_of(settings or [])
    if live:
        from engine_mount.cli.screen import TerminalScreen
        from engine_mount.drives.live import play_live
        from mount_bringup.graph.domain import chosen_domain

        if maps or map_file or table or out or json_file:
            raise typer.BadParameter('--live only shows; --map, --table, --out and --json do not go with it')
        play_live(
            local(recording, console), TerminalScreen(console), mount=mount,
            rate=1.0 if rate is None else rate, begin=start, with_control=with_control,
            changes=changes, domain=chosen_domain(domain), namespace=namespace,
        )  # fmt: skip
        return
    if start or with_control or namespace:
        raise typer.BadParameter('--from, --with-control and --namespace go with --live')
    from engine_mount.cli.screen import TerminalScreen, progress_bar
    from engine_mount.drives.replay import replay as run_replay
    from engine_mount.recordings.screen import Table
    from engine_mount.reports.json_file import write_json
    from engine_mount.settings.run_folder import new_place

    foreign = None
    if maps or map_file:
        from engine_mount.drives.inputs.foreign import foreign_order

        foreign = foreign_order(
            maps or [], scale, offset, mapping_file=map_file, time=time, rate=rate,
            stated=stated(dbc, decimal, delimiter),
        )  # fmt: skip
    elif rate is not None or scale is not None or offset or time:
        raise typer.BadParameter('--scale, --offset, --time and --rate go with --map or --map-file')
    mode = 'lock-step' if lockstep else 'core'
    place, table = local(recording, console), table and str(local(table, console))
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task(f'replaying ({mode})', total=1.0)
        replayed = run_replay(
            place, changes, lockstep=lockstep, table=table, foreign=foreign, mount=mount,
            out=out or new_place(f'replay_{mode}'), domain=domain,
            progress=lambda share: progress.update(task, completed=share),
        )  # fmt: skip
    figures, screen = replayed.figures, TerminalScreen(console)
    screen.table(Table(f'replay of {figures["source"]}, {mode}', 'll', replayed.rows()))
    for sentence in figures['notes']:
        screen.note(sentence)
    assert replayed.folder is not None
    write_json(figures, replayed.folder.summary)
    if json_file is not None:
        write_json(figures, json_file)
    console.print(f'recording  {replayed.recording}', soft_wrap=True)
    if not replayed.held:
        raise typer.Exit(1)
