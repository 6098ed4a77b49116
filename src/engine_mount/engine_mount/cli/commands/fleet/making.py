"""`engine-mount fleet example`, `index` and `replay`: they make recordings and tables."""

import contextlib
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from engine_mount.cli.commands.options import JsonFile, Scheduler, Workers
from engine_mount.cli.commands.other_than_recorded import OtherThanRecorded, changes_of
from engine_mount.cli.completion import named
from engine_mount.cli.terminal import note, terminal

EXAMPLE_EPILOG = """Exit code: 0 when all recordings are made; 1 when one is not, or the order was refused.

Examples:

`engine-mount fleet example --out drives` - 200 recordings, some 7 s each

`engine-mount fleet example --out few --recordings 24` - some of them, each kind of damage among them

`engine-mount fleet example --out long --recordings 8 --seconds 600` - longer ones

Ten drives in twenty variations (parameters, mounts, pieces); six are damaged, each in its own way. The same
order makes the same bytes each time.
"""
INDEX_EPILOG = """Exit code: 0 when the catalogue is written, also where recordings are damaged, which
their rows tell; 1 when a place cannot be listed, its store no longer answers, or the cluster is lost.

Examples:

`engine-mount fleet index drives --out catalogue` - all recordings below a folder

`engine-mount fleet index s3://bucket/drives sftp://host/data/drives --out catalogue` - in stores

`engine-mount fleet index drives --out catalogue --scheduler tcp://10.0.0.5:8786` - read by a Dask cluster,
whose workers must reach the same places

What did not change is not read again, what is gone leaves the catalogue. After Ctrl-C, or whatever ended it,
the same command goes on where it stopped. Foreign files are imported first: `engine-mount import`.
"""
REPLAY_EPILOG = """Exit code: 0 when every recording has its row, with figures or with the reason why
not; 1 when one could not be fetched, or the order was refused.

Examples:

`engine-mount fleet replay drives --set mount_control.highest_current=2.0 --out result`

`engine-mount fleet replay CATALOGUE --policy switched_viscous --out result --workers 2`

`engine-mount fleet replay s3://bucket/drives --set continuous_viscous.full_amplitude=0.0006 --out result`

`engine-mount fleet replay drives --set highest_current=2.0 --closed-loop --out moved` - and the motion?

Recordings are told as replayed, with another policy (which does not have a changed parameter), or failed. An
interrupted run goes on with the same command. The table is result.parquet in the folder of the result;
setpoints are compared for the recorded displacement, with --closed-loop the displacement is simulated anew.
"""

_GOES_ON = 'the same command goes on where it stopped'
_LISTED = 10  # chosen: recordings that could not be fetched; all of them are in the table


def example(
    out: Annotated[Path, typer.Option(metavar='FOLDER', help='folder to create')],
    recordings: Annotated[
        int, typer.Option(metavar='NUMBER', help='how many of the fleet, spread over it')
    ] = 200,
    seconds: Annotated[
        float,
        typer.Option(metavar='S', help='length of the excitation of each drive, a sweep at most its own'),
    ] = 4.0,
    workers: Annotated[int, typer.Option(min=0, metavar='NUMBER', help='processes; 0: one on each core')] = 0,
) -> None:
    """Make recordings of short simulated drives, a few of them damaged, to try a fleet on."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.example import make_example

    console = terminal()
    failed = 0
    with TerminalScreen(console).bar('driving') as show:
        for count, done in enumerate(make_example(out, recordings, seconds, workers), 1):
            show(count / recordings, detail=f'{count} of {recordings}')
            if done.result is None:
                failed += 1
                note(console, done.reason)
    console.print(f'recordings {recordings - failed} in {out}', soft_wrap=True)
    if failed:
        raise typer.Exit(1)


def index(
    uris: Annotated[list[str], typer.Argument(metavar='URI...', help='folders or recordings, paths or URIs')],
    out: Annotated[Path, typer.Option(metavar='CATALOGUE', help='folder to make or to bring up to date')],
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    json_file: JsonFile = None,
) -> None:
    """Write what each recording is and holds into a catalogue: a row for it, and one for each event."""
    from time import monotonic

    from engine_mount.fleet.catalogue import index
    from engine_mount.reports.json_file import write_json

    console, began = terminal(), monotonic()
    with _resumable(console, 'indexing', transient=True) as progress:
        found = index(uris, out, progress, scheduler=scheduler, workers=workers)
    counts = {name: getattr(found, name) for name in ('read', 'unchanged', 'unreadable')}
    for name, count in {**counts, 'catalogue': out}.items():
        console.print(f'{name:<12}{count}', soft_wrap=True)
    if found.unreadable:
        what = f'{found.unreadable} {"is" if found.unreadable == 1 else "are"} unreadable'
        _note_question(console, what, out, "recordings where kind = 'unreadable'")
    if json_file is not None:
        figures = {'catalogue': str(out), 'rows': found.recordings.num_rows, **counts}
        write_json(figures | {'wall_s': monotonic() - began}, json_file)


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
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    json_file: JsonFile = None,
) -> None:
    """Replay each recording as recorded and with other parameters: a table with one row for each mount."""
    from engine_mount.fleet.replay import replay_fleet
    from engine_mount.reports.json_file import write_json

    changes = changes_of([*(settings or []), *([f'policy={policy}'] if policy else [])])
    if not changes:
        raise typer.BadParameter('say what is to be other than recorded, with --set or --policy')
    console = terminal()
    with _resumable(console, 'replaying') as progress:
        options = {'scheduler': scheduler, 'workers': workers}
        done = replay_fleet(places, changes, out, closed_loop, progress, **options)
    figures = done.figures
    before = f' ({figures["done_before"]} done before)' if figures['done_before'] else ''
    others = f'{figures["another_policy"]} with another policy, ' if figures['another_policy'] else ''
    lines = [
        f'recordings {figures["recordings"]}{before}: {figures["replayed"]} replayed, {others}'
        f'{figures["failed"]} failed',
        f'replayed   {figures["replayed_s"]:.0f} s in {figures["wall_s"]:.1f} s, '
        f'{figures["real_time_factor"]:.0f} x real time',
        f'result     {out}',
    ]
    console.print('\n'.join(lines), soft_wrap=True)
    if figures['failed']:
        _note_question(console, f'{figures["failed"]} failed', out, "result where outcome = 'failed'")
    if json_file is not None:
        write_json(figures, json_file)
    for row in done.not_fetched[:_LISTED]:
        note(console, f'{row["recording"]} (the same command tries it again): {row["reason"]}')
    if (more := len(done.not_fetched) - _LISTED) > 0:
        note(console, f'{more} more, whose rows tell the reason; the same command tries them again')
    if done.not_fetched:
        raise typer.Exit(1)


@contextlib.contextmanager
def _resumable(console: Console, what: str, **options: Any) -> Iterator[Any]:
    """Give what shows the progress of a job, and say after an interrupt or a lost cluster how it goes on."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.runner import SchedulerLostError
    from mount_bringup.graph.shutdown import Interrupted

    with TerminalScreen(console).bar(what, **options) as show:
        try:
            yield lambda done, of: show(done / max(of, 1), detail=f'{done} of {of} recordings')
        except KeyboardInterrupt:
            raise Interrupted(f'what was done stands, and {_GOES_ON}') from None
        except SchedulerLostError as error:
            raise SchedulerLostError(f'{error}; with this cluster or another one {_GOES_ON}') from None


def _note_question(console: Console, what: str, folder: Path, rows: str) -> None:
    """Print the command that lists the recordings of these rows, each with its reason."""
    sql = f'select recording, reason from {rows}'
    note(console, f'why {what}: engine-mount fleet query {shlex.quote(str(folder))} "{sql}"')
