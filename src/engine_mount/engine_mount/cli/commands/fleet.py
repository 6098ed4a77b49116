"""`engine-mount fleet`: many recordings; its sub-commands make tables and answer questions of them."""

import contextlib
import json
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine_mount.cli.commands.options import (
    JsonFile,
    Scheduler,
    Settings,
    Workers,
    argument,
    changes_of,
    flag,
    names_in,
    new_screen,
    option,
    write_figures,
)
from engine_mount.cli.help import Command, group

if TYPE_CHECKING:
    import pyarrow

    from engine_mount.cli.screen import TerminalScreen

app = group('fleet', 'Many recordings: catalogue, what if, queries.')

_INDEX_EPILOG = """Exit code: 0 when the catalogue is written, also when recordings are damaged, which
their rows show; 1 when a store no longer answers or the cluster is lost; 2 when a place does not exist.

Examples:

`engine-mount fleet index drives --out catalogue` - all recordings below a folder

`engine-mount fleet index s3://bucket/drives sftp://host/data/drives --out catalogue` - in stores

`engine-mount fleet index drives --out catalogue --scheduler tcp://10.0.0.5:8786` - read by a Dask cluster,
whose workers must reach the same places

Unchanged recordings are not read again, missing ones leave the catalogue. After Ctrl-C or any other end, the
same command resumes where it stopped. Import foreign files first: `engine-mount import`.
"""
_REPLAY_EPILOG = """Exit code: 0 when every recording has its row, with figures or with a reason; 1
when one could not be fetched; 2 when the order was refused.

Examples:

`engine-mount fleet replay drives --set mount_control.highest_current=2.0 --out result`

`engine-mount fleet replay CATALOGUE --set policy=switched_viscous --out result --workers 2`

`engine-mount fleet replay s3://bucket/drives --set continuous_viscous.half_amplitude=0.00024 --out result`

`engine-mount fleet replay drives --set highest_current=2.0 --closed-loop --out moved` - and the motion?

The outcome of a recording is replayed, another policy (which does not have a changed parameter), or failed.
The same command resumes an interrupted run. The table is result.parquet in the folder of the result;
setpoints are compared for the recorded displacement, with --closed-loop the displacement is simulated anew.
"""

_GOES_ON = 'the same command goes on where it stopped'
_LISTED = 10  # chosen: recordings that could not be fetched; all of them are in the table


@app.command(cls=Command, epilog=_INDEX_EPILOG)
def index(
    uris: Annotated[list[str], argument('folders or recordings, paths or URIs', 'URI...')],
    out: Annotated[Path, option('folder to make or to bring up to date', 'CATALOGUE')],
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    json_file: JsonFile = None,
) -> None:
    """Write the content of each recording into a catalogue: a row for it, and one for each event."""
    from time import monotonic

    from engine_mount.fleet.catalogue import index

    screen, began = new_screen(), monotonic()
    with _resumable(screen, 'indexing', transient=True) as progress:
        found = index(uris, out, progress, scheduler=scheduler, workers=workers)
    counts = {name: getattr(found, name) for name in ('read', 'unchanged', 'unreadable')}
    for name, count in {**counts, 'catalogue': out}.items():
        screen.say(f'{name:<12}{count}')
    if found.unreadable:
        _note_question(screen, f'{found.unreadable} unreadable', out, "recordings where kind = 'unreadable'")
    figures = {'catalogue': str(out), 'rows': found.recordings.num_rows, **counts}
    write_figures(figures | {'wall_s': monotonic() - began}, json_file)


@app.command(cls=Command, epilog=_REPLAY_EPILOG)
def replay(
    places: Annotated[
        list[str],
        argument('catalogues, or folders and URIs below which recordings lie', 'CATALOGUE|URI...'),
    ],
    out: Annotated[Path, option('folder of the result, new or interrupted', 'RESULT')],
    settings: Settings = None,
    closed_loop: Annotated[
        bool, flag('--closed-loop', 'simulate engine and mount anew over recorded accelerations')
    ] = False,
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    json_file: JsonFile = None,
) -> None:
    """Replay each recording as recorded and with other parameters: a table with one row for each mount."""
    from engine_mount.drives.replay import parsed_changes
    from engine_mount.fleet.replay import replay_fleet

    changes = parsed_changes(changes_of(settings))
    if not changes:
        raise typer.BadParameter('say what is to be other than recorded: --set NAME=VALUE')
    screen = new_screen()
    with _resumable(screen, 'replaying') as progress:
        done = replay_fleet(places, changes, out, closed_loop, progress, scheduler=scheduler, workers=workers)
    figures = done.figures
    before = f' ({figures["done_before"]} done before)' if figures['done_before'] else ''
    others = f'{figures["another_policy"]} with another policy, ' if figures['another_policy'] else ''
    screen.say(
        f'recordings {figures["recordings"]}{before}: {figures["replayed"]} replayed, {others}'
        f'{figures["failed"]} failed'
    )
    screen.say(
        f'replayed   {figures["replayed_s"]:.0f} s in {figures["wall_s"]:.1f} s, '
        f'{figures["real_time_factor"]:.0f} x real time'
    )
    screen.say(f'result     {out}')
    if figures['failed']:
        _note_question(screen, f'{figures["failed"]} failed', out, "result where outcome = 'failed'")
    write_figures(figures, json_file)
    for row in done.not_fetched[:_LISTED]:
        screen.note(f'{row["recording"]} (the same command tries it again): {row["reason"]}')
    if (more := len(done.not_fetched) - _LISTED) > 0:
        screen.note(f'{more} more, whose rows tell the reason; the same command tries them again')
    if done.not_fetched:
        raise typer.Exit(1)


@contextlib.contextmanager
def _resumable(
    screen: 'TerminalScreen', what: str, *, transient: bool = False
) -> Iterator[Callable[[int, int], None]]:
    """Give what shows the progress of a job, and say after an interrupt or a lost cluster how it goes on."""
    from engine_mount.fleet.runner import SchedulerLostError
    from mount_bringup.graph.shutdown import Interrupted

    with screen.bar(what, transient=transient) as show:
        try:
            yield lambda done, of: show(done / max(of, 1), detail=f'{done} of {of} recordings')
        except KeyboardInterrupt:
            raise Interrupted(f'what was done stands, and {_GOES_ON}') from None
        except SchedulerLostError as error:
            raise SchedulerLostError(f'{error}; with this cluster or another one {_GOES_ON}') from None


def _note_question(screen: 'TerminalScreen', what: str, folder: Path, rows: str) -> None:
    """Print the command that lists the recordings of these rows, each with its reason."""
    sql = f'select recording, reason from {rows}'
    screen.note(f'why {what}: engine-mount fleet query {shlex.quote(str(folder))} "{sql}"')


_QUERY_EPILOG = """Exit code: 0 when the query has a result, 2 with the reason when not.

Examples:

`engine-mount fleet query catalogue "select scenario, count(*) from recordings group by all"`

`engine-mount fleet query catalogue "select uri, reason from recordings where reason != ''" --format csv`

`engine-mount fleet query result "select recording from result where switchings_vanished > 0" --format json`

Tables are `recordings` and `events` of a catalogue, `result` of a replay; their columns stand in
docs/reference/fleet_columns.md, and `describe result` lists them. A query is one SELECT: it writes nothing,
and reads these tables and no other file.
"""
_WORST_EPILOG = """Exit code: 0 when the column exists, 2 with the reason when not.

Examples:

`engine-mount fleet worst result --by setpoint_difference_rms_a` - where the change matters most

`engine-mount fleet worst catalogue --by peak_displacement_m --count 3` - the largest motions

`engine-mount fleet query catalogue "from recordings order by contact_gap_m limit 10"` - the smallest gaps
"""
_REPORT_EPILOG = """Exit code: 0 when the page is written, also when a recording could not be read again for
its picture, which the page reports; 2 when there is no result.

Examples:

`engine-mount fleet report result` - result/report.html

`engine-mount fleet report result --by pad_energy_changed_j --count 5 --out energy.html`
"""

_EXAMPLE_EPILOG = """Exit code: 0 when all recordings are made; 1 when one is not; 2 when the order is wrong.

Examples:

`engine-mount fleet example --out drives` - 200 recordings, some 7 s each

`engine-mount fleet example --out few --recordings 24` - some of them, each kind of damage among them

`engine-mount fleet example --out long --recordings 8 --seconds 600` - longer ones

Ten drives in twenty variations (parameters, mounts, pieces); five are damaged, each in its own way. The same
order makes the same bytes each time.
"""

_NUMBERS = ('int', 'uint', 'float', 'double', 'decimal')


@app.command(cls=Command, epilog=_QUERY_EPILOG)
def query(
    folder: Annotated[Path, argument('catalogue or result', 'FOLDER')],
    sql: Annotated[str, argument('one SELECT', 'SQL')],
    form: Annotated[str, option('table, csv, or json: a list of rows', 'FORMAT', None, '--format')] = 'table',
    time_limit: Annotated[float, option('a query that takes longer is refused', 'S', least=0.1)] = 60.0,
) -> None:
    """Query a catalogue or a result in SQL."""
    from engine_mount.fleet.questions import query

    names_in(form, ('table', 'csv', 'json'), 'format')
    answer = query(folder, sql, time_limit)
    if form in ('csv', 'json'):
        typer.echo(_csv(answer) if form == 'csv' else _json(answer), nl=False)
    else:
        _print_rows(answer, new_screen())


@app.command(cls=Command, epilog=_WORST_EPILOG)
def worst(
    folder: Annotated[Path, argument('result or catalogue', 'FOLDER')],
    by: Annotated[str, option('column of numbers', 'COLUMN')],
    count: Annotated[int, option('how many', least=1)] = 10,
    json_file: JsonFile = None,
) -> None:
    """List the recordings with the largest values of a column, with the commands that open them."""
    from engine_mount.fleet.questions import worst

    screen, rows = new_screen(), []
    for row, uri, commands in worst(folder, by, count):
        recording, mount, value = row['recording'], row['mount'] or '', row[by]
        rows.append({'recording': recording, 'mount': mount, 'uri': uri, by: value, 'commands': commands})
        name = f'{recording} {mount}'.rstrip()
        screen.say('\n    '.join([f'{len(rows):>2}. {name}: {by} {value:.6g}', *commands]))
    if not rows:
        screen.say(f'no row has a number in {by}')
    write_figures({'by': by, 'worst': rows}, json_file)


@app.command(cls=Command, epilog=_REPORT_EPILOG)
def report(
    result: Annotated[Path, argument('folder of fleet replay', 'RESULT')],
    out: Annotated[Path | None, option('the page; default: report.html in RESULT', 'FILE')] = None,
    by: Annotated[str, option('column that ranks the worst; default: the largest difference', 'COLUMN')] = '',
    count: Annotated[int, option('recordings with a picture of their own', least=0)] = 10,
) -> None:
    """Write one page: figures before and after the change, the worst recordings, failures with reasons.

    The recordings with pictures are read once more. The page needs no network.
    """
    from engine_mount.fleet.page import write_page

    screen = new_screen()
    with screen.bar('replaying the worst', transient=True) as show:
        file, looks = write_page(result, out, by, count, lambda share, name: show(share, detail=name))
    for look in looks:
        if look.reason:
            screen.note(f'{look.name}: no picture: {look.reason}')
    screen.say(f'report     {file}')


@app.command(cls=Command, epilog=_EXAMPLE_EPILOG)
def example(
    out: Annotated[Path, option('folder to create', 'FOLDER')],
    recordings: Annotated[int, option('number of recordings, spread over the fleet')] = 200,
    seconds: Annotated[
        float, option('length of the excitation of each drive, a sweep at most its own', 'S')
    ] = 4.0,
    workers: Workers = 0,
) -> None:
    """Make recordings of short simulated drives, a few of them damaged, as examples of a fleet."""
    from engine_mount.fleet.example import make_example

    screen, failed = new_screen(), 0
    with screen.bar('driving') as show:
        for count, done in enumerate(make_example(out, recordings, seconds, workers), 1):
            show(count / recordings, detail=f'{count} of {recordings}')
            if done.result is None:
                failed += 1
                screen.note(done.reason)
    screen.say(f'recordings {recordings - failed} in {out}')
    if failed:
        raise typer.Exit(1)


def _print_rows(answer: 'pyarrow.Table', screen: 'TerminalScreen') -> None:
    """Print rows as a table where it fits the terminal, else one below another."""
    from engine_mount.recordings.screen import Table

    names = answer.column_names
    rows = [[_text(value) for value in row.values()] for row in answer.to_pylist()]
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    if sum(widths) + len(widths) <= screen.console.width:
        sides = ''.join('r' if str(kind).startswith(_NUMBERS) else 'l' for kind in answer.schema.types)
        screen.table(Table('', sides, rows, names))
    else:
        for row in rows:
            pairs = zip(names, row, strict=True)
            screen.say('\n'.join(f'{name:<{max(map(len, names))}}  {text}' for name, text in pairs) + '\n')
    screen.say(f'{len(rows)} row{"" if len(rows) == 1 else "s"}')


def _text(value: Any) -> str:
    if value is None:
        return ''
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def _csv(answer: 'pyarrow.Table') -> str:
    import pyarrow
    import pyarrow.csv

    sink = pyarrow.BufferOutputStream()
    pyarrow.csv.write_csv(answer, sink)
    return sink.getvalue().to_pybytes().decode('utf-8')


def _json(answer: 'pyarrow.Table') -> str:
    """Return a list of rows, a row a line; what JSON has no word for is a text, NaN is null."""
    rows = (
        {name: None if value != value else value for name, value in row.items()} for row in answer.to_pylist()
    )
    lines = ',\n'.join(json.dumps(row, ensure_ascii=False, allow_nan=False, default=str) for row in rows)
    return f'[\n{lines}\n]\n' if lines else '[]\n'
