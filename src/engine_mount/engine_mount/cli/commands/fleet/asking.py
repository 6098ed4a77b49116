"""`engine-mount fleet query`, `worst` and `report`: what the tables of a fleet say."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine_mount.cli.commands.options import JsonFile, argument, flag, option, write_figures

if TYPE_CHECKING:
    import pyarrow

    from engine_mount.cli.screen import TerminalScreen

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

_NUMBERS = ('int', 'uint', 'float', 'double', 'decimal')


def query(
    folder: Annotated[Path, argument('catalogue or result', 'FOLDER')],
    sql: Annotated[str, argument('one SELECT', 'SQL')],
    csv: Annotated[bool, flag('--csv', 'print the answer as CSV')] = False,
    as_json: Annotated[bool, flag('--json', 'print the answer as JSON: a list of rows')] = False,
    time_limit: Annotated[float, option('a question that takes longer is refused', 'S', least=0.1)] = 60.0,
) -> None:
    """Ask a catalogue or a result a question in SQL."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.questions import query

    if csv and as_json:
        raise typer.BadParameter('choose --csv or --json, not both')
    answer = query(folder, sql, time_limit)
    if csv or as_json:
        typer.echo(_csv(answer) if csv else _json(answer), nl=False)
    else:
        _print_rows(answer, TerminalScreen())


def worst(
    folder: Annotated[Path, argument('result or catalogue', 'FOLDER')],
    by: Annotated[str, option('column of numbers', 'COLUMN')],
    count: Annotated[int, option('how many', least=1)] = 10,
    json_file: JsonFile = None,
) -> None:
    """List the recordings with the largest values of a column, with the commands that open them."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.questions import worst

    screen, rows = TerminalScreen(), []
    for row, uri, commands in worst(folder, by, count):
        recording, mount, value = row['recording'], row['mount'] or '', row[by]
        rows.append({'recording': recording, 'mount': mount, 'uri': uri, by: value, 'commands': commands})
        name = f'{recording} {mount}'.rstrip()
        screen.say('\n    '.join([f'{len(rows):>2}. {name}: {by} {value:.6g}', *commands]))
    if not rows:
        screen.say(f'no row has a number in {by}')
    write_figures({'by': by, 'worst': rows}, json_file)


def report(
    result: Annotated[Path, argument('folder of fleet replay', 'RESULT')],
    out: Annotated[Path | None, option('the page; default: report.html in RESULT', 'FILE')] = None,
    by: Annotated[
        str, option('by which the worst are chosen; default: the largest difference', 'COLUMN')
    ] = '',
    count: Annotated[int, option('recordings with a picture of their own', least=0)] = 10,
) -> None:
    """Write one page: how figures are spread before and after the change, the worst, what failed and why.

    The recordings with pictures are read once more. The page needs no network.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.page import write_page

    screen = TerminalScreen()
    with screen.bar('replaying the worst', transient=True) as show:
        file, looks = write_page(result, out, by, count, lambda share, name: show(share, detail=name))
    for look in looks:
        if look.reason:
            screen.note(f'{look.name}: no picture: {look.reason}')
    screen.say(f'report     {file}')


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
