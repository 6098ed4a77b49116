"""`engine-mount fleet query`: questions in SQL to a catalogue or a result."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from engine_mount.cli.terminal import terminal

if TYPE_CHECKING:
    import pyarrow

EPILOG = """Exit code: 0 when the question is answered, 1 with the reason when not.

Examples:

`engine-mount fleet query catalogue "select scenario, count(*) from recordings group by all"`

`engine-mount fleet query catalogue "select uri, reason from recordings where reason != ''" --csv`

`engine-mount fleet query result "select recording from result where switchings_vanished > 0" --json`

Tables are `recordings` and `events` of a catalogue, `result` of a replay; their columns stand in
docs/reference/fleet_columns.md, and `describe result` lists them. A question is one SELECT: it writes
nothing, and reads these tables and no other file.
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
    from engine_mount.fleet.questions import query as answer_of

    if csv and as_json:
        raise typer.BadParameter('choose --csv or --json, not both')
    if out is not None and not (csv or as_json):
        raise typer.BadParameter('--out goes with --csv or --json')
    answer = answer_of(folder, sql, time_limit)
    if not (csv or as_json):
        print_rows(answer, terminal())
        return
    text = _csv(answer) if csv else _json(answer)
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, encoding='utf-8')


def print_rows(answer: 'pyarrow.Table', console: Console) -> None:
    """Print rows as a table where it fits the terminal, else one below another."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.screen import Table

    names = answer.column_names
    rows = [[_text(value) for value in row.values()] for row in answer.to_pylist()]
    to = ''.join('r' if _is_number(answer.schema.field(name).type) else 'l' for name in names)
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    least = sum(width if side == 'r' else min(width, _FOLDED) for width, side in zip(widths, to, strict=True))
    if least + len(widths) <= console.width:
        TerminalScreen(console).table(Table('', to, rows, names))
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


def _is_number(kind: Any) -> bool:
    return str(kind).startswith(('int', 'uint', 'float', 'double', 'decimal'))


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
