"""`engine-mount fleet replay`: what another controller would have answered on many recordings."""

from pathlib import Path
from typing import Annotated, Any

import typer

from engine_mount.cli.commands.fleet.reasons import tell_question
from engine_mount.cli.commands.fleet.resuming import resumable
from engine_mount.cli.commands.options import Dbc, JsonFile, MapFiles, Scheduler, Workers
from engine_mount.cli.commands.other_than_recorded import OtherThanRecorded, changes_of
from engine_mount.cli.completion import named
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when every recording has its row, with figures or with the reason why not; 1 when one
could not be fetched, or the order was refused.

Examples:

`engine-mount fleet replay drives --set mount_control.highest_current=2.0 --out result`

`engine-mount fleet replay CATALOGUE --policy switched_viscous --out result --workers 2`

`engine-mount fleet replay s3://bucket/drives --set continuous_viscous.full_amplitude=0.0006 --out result`

`engine-mount fleet replay drives --set highest_current=2.0 --closed-loop --out moved` - and the motion?

`engine-mount fleet replay catalogue --map rack_2.yaml --set highest_current=2.0 --out result` - files of
others too

Recordings are told as replayed, with another policy (which does not have a changed parameter), or failed. An
interrupted run goes on with the same command. The table is result.parquet in the folder of the result;
setpoints are compared for the recorded displacement, with --closed-loop the displacement is simulated anew.
"""

_TOLD = 10  # chosen: recordings that could not be fetched; all of them are in the table


def replay(
    places: Annotated[
        list[str],
        typer.Argument(
            metavar='CATALOGUE|URI...', help='catalogues, or folders and URIs below which recordings lie'
        ),
    ],
    out: Annotated[Path, typer.Option(metavar='RESULT', help='folder of the result, new or interrupted')],
    settings: OtherThanRecorded = None,
    policy: Annotated[
        str, typer.Option(metavar='NAME', help='another policy', autocompletion=named('policy'))
    ] = '',
    closed_loop: Annotated[
        bool,
        typer.Option('--closed-loop', help='simulate engine and mount anew over recorded accelerations'),
    ] = False,
    map_files: MapFiles = None,
    dbc: Dbc = None,
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    json_file: JsonFile = None,
) -> None:
    """Replay each recording as recorded and with other parameters: a table with one row for each mount."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.foreign import said_in
    from engine_mount.fleet.job import Progress
    from engine_mount.fleet.what_if.run import FleetOrder, replay_fleet
    from engine_mount.reports.json_file import write_json

    changes = changes_of([*(settings or []), *([f'policy={policy}'] if policy else [])])
    if not changes:
        raise typer.BadParameter('say what is to be other than recorded, with --set or --policy')
    console = terminal()
    order = FleetOrder(places, changes, closed_loop, said_in(map_files or [], dbc))
    with resumable(), TerminalScreen(console).bar('replaying') as show:

        def report(progress: Progress) -> None:
            show(progress.done / progress.of, detail=_progress_text(progress))

        outcome = replay_fleet(order, out, scheduler=scheduler, workers=workers, progress=report)
    figures = outcome.figures()
    _print(figures, out, console)
    if figures['failed']:
        tell_question(console, f'{figures["failed"]} failed', out, 'result', "outcome = 'failed'")
    if json_file is not None:
        write_json(figures, json_file)
    for row in outcome.not_fetched[:_TOLD]:
        note(console, f'{row["recording"]} (the same command tries it again): {row["reason"]}')
    if (others := len(outcome.not_fetched) - _TOLD) > 0:
        note(console, f'{others} more, whose rows tell the reason; the same command tries them again')
    if outcome.not_fetched:
        raise typer.Exit(1)


def _progress_text(progress: Any) -> str:
    text = f'{progress.done} of {progress.of}, {progress.rate:.1f} recordings/s, {progress.left:.0f} s left'
    return text + (f', {progress.failed} failed' if progress.failed else '')


def _print(figures: dict[str, Any], out: Path, console: Any) -> None:
    before = f' ({figures["done_before"]} done before)' if figures['done_before'] else ''
    others = f'{figures["another_policy"]} with another policy, ' if figures['another_policy'] else ''
    console.print(
        f'recordings {figures["recordings"]}{before}: {figures["replayed"]} replayed, {others}'
        f'{figures["failed"]} failed',
        soft_wrap=True,
    )
    if figures['workers']:
        console.print(
            f'replayed   {figures["replayed_s"]:.0f} s in {figures["wall_s"]:.1f} s, '
            f'{figures["real_time_factor_per_core"]:.0f} x real time on each of {figures["workers"]} cores',
            soft_wrap=True,
        )
    console.print(f'result     {out}', soft_wrap=True)
