"""`engine-mount fleet query`, `worst` and `report`: what the tables of a fleet say."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from engine_mount.cli.commands.options import JsonFile
from engine_mount.cli.terminal import note, terminal

if TYPE_CHECKING:
    import pyarrow

QUERY_EPILOG = """Exit code: 0 when the question is answered, 1 with the reason when not.

Examples:

`engine-mount fleet query catalogue "select scenario, count(*) from recordings group by all"`

`engine-mount fleet query catalogue "select uri, reason from recordings where reason != ''" --csv`

`engine-mount fleet query result "select recording from result where switchings_vanished > 0" --json`

Tables are `recordings` and `events` of a catalogue, `result` of a replay; their columns stand in
docs/reference/fleet_columns.md, and `describe result` lists them. A question is one SELECT: it writes
nothing, and reads these tables and no other file.
"""
WORST_EPILOG = """Exit code: 0 when the column is there, 1 with the reason when not.

Examples:

`engine-mount fleet worst result --by setpoint_difference_rms_a` - where the change matters most

`engine-mount fleet worst catalogue --by peak_displacement_m --count 3` - the largest motions

`engine-mount fleet query catalogue "from recordings order by contact_gap_m limit 10"` - the smallest gaps
"""
REPORT_EPILOG = """Exit code: 0 when the page is written, also where a recording could not be read again for
its picture, which the page says; 1 when there is no result, or the page cannot be written.

Examples:

`engine-mount fleet report result` - result/report.html

`engine-mount fleet report result --by pad_energy_changed_j --count 5 --out energy.html`
"""

_FOLDED = 24  # characters, chosen: a text column of a table is at least so wide


def query(
    folder: Annotated[Path, typer.Argument(metavar='FOLDER', help='catalogue or result')],
    sql: Annotated[str, typer.Argument(metavar='SQL', help='one SELECT')],
    csv: Annotated[bool, typer.Option('--csv', help='print the answer as CSV')] = False,
    as_json: Annotated[bool, typer.Option('--json', help='print the answer as JSON: a list of rows')] = False,
    out: Annotated[
        Path | None, typer.Option(metavar='FILE', help='with --csv or --json: write the answer to this file')
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=0.1, metavar='S', help='a question that takes longer is refused')
    ] = 60.0,
) -> None:
    """Ask a catalogue or a result a question in SQL."""
    from engine_mount.fleet.questions import query

    if csv and as_json:
        raise typer.BadParameter('choose --csv or --json, not both')
    if out is not None and not (csv or as_json):
        raise typer.BadParameter('--out goes with --csv or --json')
    answer = query(folder, sql, time_limit)
    if not (csv or as_json):
        _print_rows(answer, terminal())
        return
    text = _csv(answer) if csv else _json(answer)
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, encoding='utf-8')


def worst(
    folder: Annotated[Path, typer.Argument(metavar='FOLDER', help='result or catalogue')],
    by: Annotated[str, typer.Option(metavar='COLUMN', help='column of numbers')],
    count: Annotated[int, typer.Option(min=1, metavar='NUMBER', help='how many')] = 10,
    json_file: JsonFile = None,
) -> None:
    """List the recordings with the largest values of a column, with the commands that open them."""
    from engine_mount.fleet.questions import worst
    from engine_mount.reports.json_file import write_json

    console = terminal()
    found = worst(folder, by, count)
    rows = []
    for number, (row, uri, commands) in enumerate(found, 1):
        recording, mount, value = row['recording'], row['mount'] or '', row[by]
        name = f'{recording} {mount}'.rstrip()
        console.print('\n    '.join([f'{number:>2}. {name}: {by} {value:.6g}', *commands]), soft_wrap=True)
        rows.append({'recording': recording, 'mount': mount, 'uri': uri, by: value, 'commands': commands})
    if not found:
        console.print(f'no row has a number in {by}')
    if json_file is not None:
        write_json({'by': by, 'worst': rows}, json_file)


def report(
    result: Annotated[Path, typer.Argument(metavar='RESULT', help='folder of fleet replay')],
    out: Annotated[
        Path | None, typer.Option(metavar='FILE', help='the page; default: report.html in RESULT')
    ] = None,
    by: Annotated[
        str,
        typer.Option(metavar='COLUMN', help='by which the worst are chosen; default: the largest difference'),
    ] = '',
    count: Annotated[
        int, typer.Option(min=0, metavar='NUMBER', help='recordings with a picture of their own')
    ] = 10,
) -> None:
    """Write one page: how figures are spread before and after the change, the worst, what failed and why.

    The recordings with pictures are read once more. The page needs no network.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.page import write_page

    console = terminal()
    with TerminalScreen(console).bar('replaying the worst', transient=True) as show:
        file, looks = write_page(result, out, by, count, lambda share, name: show(share, detail=name))
    for look in looks:
        if look.reason:
            note(console, f'{look.name}: no picture: {look.reason}')
    console.print(f'report     {file}', soft_wrap=True)


def _print_rows(answer: 'pyarrow.Table', console: Console) -> None:
    """Print rows as a table where it fits the terminal, else one below another."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.screen import Table

    names = answer.column_names
    rows = [[_text(value) for value in row.values()] for row in answer.to_pylist()]
    numbers = [
        str(kind).startswith(('int', 'uint', 'float', 'double', 'decimal')) for kind in answer.schema.types
    ]
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    least = [width if number else min(width, _FOLDED) for width, number in zip(widths, numbers, strict=True)]
    if sum(least) + len(least) <= console.width:
        sides = ''.join('r' if number else 'l' for number in numbers)
        TerminalScreen(console).table(Table('', sides, rows, names))
    else:
        label = max(map(len, names))
        for row in rows:
            for name, text in zip(names, row, strict=True):
                console.print(f'{name:<{label}}  {text}', soft_wrap=True)
            console.print()
    console.print(f'{len(rows)} row{"" if len(rows) == 1 else "s"}')


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
