"""`engine-mount ls` and `info`: which recordings there are, and what one of them is."""

from datetime import datetime
from typing import Annotated, Any

import typer

from engine_mount.cli.commands.options import Dbc, Decimal, Delimiter, JsonFile, RecordingPlace, stated
from engine_mount.cli.fetching import local, named
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0, also where a recording is damaged, which its line tells; 1 when a folder is
not there.

Examples:

`engine-mount ls` - the recordings in bags, the newest first

`engine-mount ls bags /data/drives --json recordings.json` - of several folders

The verdict is that of the run's summary: what `drive` printed. A recording without one is `whole` when
nothing of its files is missing; `engine-mount audit` tells more.
"""

INFO_EPILOG = """Exit code: 0 when the recording could be read, whatever it holds; 1 when not.

Examples:

`engine-mount info bags/first`

`engine-mount info RECORDING --json info.json`

`engine-mount info MEASURED.mf4` - of a file of others: its columns with units, rates and ranges

Parameters that a run sets by itself (bus, folder, lock-step) are left out. Whether a loss is an error is told
by the exit code of `engine-mount audit`.
"""


def ls(
    folders: Annotated[
        list[str] | None,
        typer.Argument(metavar='[FOLDER]...', help='folders of runs, or runs; default: bags'),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """List recordings: when, how long, what was driven, and whether anything was lost or went wrong."""
    from engine_mount.reports.json_file import write_json
    from engine_mount.reports.listing import list_recordings
    from engine_mount.signals.sources.uris import is_local, local_path

    console = terminal()
    if not all(map(is_local, folders or ())):
        raise ValueError(
            'ls reads folders of this machine; engine-mount info URI fetches one recording of a store'
        )
    places = [local_path(folder) for folder in folders or ['bags']]
    missing = [str(place) for place in places if not place.exists()]
    if missing:
        raise ValueError(f'{", ".join(missing)}: no such folder; engine-mount drive makes bags')
    with console.status('reading'):
        found = list_recordings(places)
    if json_file is not None:
        write_json({'recordings': found}, json_file)
    if not found:
        console.print(f'no recordings in {", ".join(map(str, places))}', soft_wrap=True)
    # Two lines for each, so that paths stay whole in 80 columns.
    rows = [_cells(one) for one in found]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for one, row in zip(found, rows, strict=True):
        style = 'yellow' if one['sound'] is False else None
        console.print(f'{one["recording"]}: {one["verdict"]}', style=style, soft_wrap=True)
        started, duration, *others = (text.ljust(width) for text, width in zip(row, widths, strict=True))
        cells = (started, duration.strip().rjust(widths[1]), *others)
        console.print('  ' + '  '.join(cells).strip(), soft_wrap=True)


def _cells(one: dict[str, Any]) -> list[str]:
    started = one['started'] and f'{datetime.fromisoformat(one["started"]):%Y-%m-%d %H:%M}'
    duration = '' if one['duration_s'] is None else f'{one["duration_s"]:.1f} s'
    others = [one[name] or '' for name in ('scenario', 'mode', 'mount', 'policy')]
    return [started or '', duration, *others]


def info(
    recording: RecordingPlace,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    json_file: JsonFile = None,
) -> None:
    """Tell what a recording is and holds: session, versions, parameters, topics, gap, losses.

    Of a file of others, its columns.
    """
    from dataclasses import asdict

    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.place import open_run
    from engine_mount.reports.json_file import write_json
    from engine_mount.reports.listing import describe_recording
    from engine_mount.signals.formats.described import columns_table, described
    from engine_mount.signals.formats.reading import is_foreign, read

    console = terminal()
    place = local(recording, console)
    figures: dict[str, Any]
    if is_foreign(place):
        with console.status('reading'):
            measured = read(place, None, stated(dbc, decimal, delimiter))
        columns, origin = described(measured), measured.provenance
        rows = [
            ('file', f'{origin.uri}, {origin.format}, read by {origin.reader}'),
            ('SHA-256', origin.sha256),
        ]
        tables, notes = [columns_table(columns)], measured.notes
        figures = {'provenance': asdict(origin), 'columns': columns, 'notes': notes}
    else:
        opened = open_run(place)
        with console.status('reading'):
            figures, rows, tables = describe_recording(opened)
        whole = 'whole' if opened.whole else 'not whole'
        rows.insert(0, ('recording', f'{named(opened.path)}, {whole}'))
        notes = opened.warnings
    for label, text in rows:
        console.print(f'{label:<20}{text}' if label else text, soft_wrap=True)
    for table in tables:
        TerminalScreen(console).table(table)
    for sentence in notes:
        note(console, sentence)
    if json_file is not None:
        write_json(figures, json_file)
