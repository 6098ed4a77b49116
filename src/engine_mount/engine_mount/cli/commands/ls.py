"""`engine-mount ls` and `info`: which recordings there are, and what one of them is."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from engine_mount.cli.commands.options import Dbc, Decimal, Delimiter, JsonFile, RecordingPlace, stated
from engine_mount.cli.fetching import local, named
from engine_mount.cli.terminal import note, terminal

if TYPE_CHECKING:
    from engine_mount.reports.listing import Listed
    from engine_mount.reports.recording_facts import RecordingFacts
    from engine_mount.signals.formats.content import Stated

EPILOG = """Exit code: 0, also where a recording is damaged, which its line tells; 1 when a folder is
not there.

Examples:

`engine-mount ls` - the recordings in bags, the newest first

`engine-mount ls bags /data/drives --json recordings.json` - of several folders

`engine-mount ls s3://bucket/drives` - in a store names and sizes; `info URI` fetches one

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
        typer.Argument(metavar='[FOLDER]...', help='folders of runs, or runs, or their URIs; default: bags'),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """List recordings: when, how long, what was driven, and whether anything was lost or went wrong."""
    from engine_mount.reports.json_file import write_json
    from engine_mount.reports.listing import listed
    from engine_mount.signals.sources.uris import is_local, local_path, shown

    console = terminal()
    places = folders or ['bags']
    missing = [place for place in places if is_local(place) and not local_path(place).exists()]
    if missing:
        raise ValueError(f'{", ".join(missing)}: no such folder; engine-mount drive makes bags')
    with console.status('reading'):
        found = listed(places)
    if json_file is not None:
        write_json({'recordings': [one.as_json() for one in found]}, json_file)
    if not found:
        console.print(f'no recordings in {", ".join(map(shown, places))}', soft_wrap=True)
    _print_listed(found, console)


def _print_listed(found: 'list[Listed]', console: Console) -> None:
    """Print two lines for each, so that paths stay whole in 80 columns."""
    rows = [
        (
            f'{one.started:%Y-%m-%d %H:%M}' if one.started else '',
            '' if one.duration is None else f'{one.duration:.1f} s',
            one.scenario,
            one.mode,
            one.mount,
            one.policy,
        )
        for one in found
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for one, row in zip(found, rows, strict=True):
        style = 'yellow' if one.sound is False else None
        console.print(f'{one.path}: {one.verdict}', style=style, soft_wrap=True)
        cells = [
            text.rjust(width) if place == 1 else text.ljust(width)
            for place, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        console.print('  ' + '  '.join(cells).strip(), soft_wrap=True)


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
    from engine_mount.recordings.place import open_run
    from engine_mount.reports.json_file import write_json
    from engine_mount.reports.recording_facts import recording_facts
    from engine_mount.signals.formats.reading import is_foreign

    console = terminal()
    place = local(recording, console)
    if is_foreign(place):
        _info_of_columns(place, stated(dbc, decimal, delimiter), console, json_file)
        return
    with console.status('reading'):
        facts = recording_facts(open_run(place))
    _print_facts(facts, console)
    if json_file is not None:
        write_json(facts.as_json(), json_file)


def _info_of_columns(place: Path, said: 'Stated', console: Console, json_file: Path | None) -> None:
    from dataclasses import asdict

    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.reports.json_file import write_json
    from engine_mount.signals.formats.described import columns_table, described
    from engine_mount.signals.formats.reading import read

    with console.status('reading'):
        measured = read(place, None, said)
    facts = described(measured)
    told = measured.provenance
    console.print(f'{"file":<20}{told.uri}, {told.format}, read by {told.reader}', soft_wrap=True)
    console.print(f'{"SHA-256":<20}{told.sha256}', soft_wrap=True)
    TerminalScreen(console).table(columns_table(facts))
    for sentence in measured.notes:
        note(console, sentence)
    if json_file is not None:
        columns = [one.as_json() for one in facts]
        write_json({'provenance': asdict(told), 'columns': columns, 'notes': measured.notes}, json_file)


def _print_facts(facts: 'RecordingFacts', console: Console) -> None:
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.session import duration_of, started_of, versions_sentence
    from mount_recorder.versions import versions

    def tell(label: str, text: str) -> None:
        console.print(f'{label:<20}{text}', soft_wrap=True)

    opened, session = facts.recording, facts.session
    started, duration = started_of(session, opened), duration_of(session, opened)
    tell('recording', f'{named(opened.path)}, {"whole" if opened.whole else "not whole"}')
    tell('started', f'{started:%Y-%m-%d %H:%M:%S}' if started else 'unknown')
    tell('duration', 'unknown' if duration is None else f'{duration:.3f} s')
    replay = 'replay of ' if 'replay' in session else ''
    driven = f'{replay}{session.get("scenario", "")}, {session.get("mode", "")}'
    tell('session', driven if session else 'none: the recording does not tell what it is')
    for mount, gap in facts.gaps.items():
        texts = [f'{name} {_gap_text(gap, f"{name}_gap")}' for name in ('rest', 'contact')]
        tell(f'gap {mount}'.strip(), ', '.join(texts))
    if facts.versions:
        parts = ('mount_bringup', 'rclpy', 'python', 'numpy')
        tell(
            'versions',
            ', '.join(f'{name} {facts.versions[name]}' for name in parts if name in facts.versions),
        )
    if session:
        console.print(versions_sentence(facts.others, versions()), soft_wrap=True)
    marks = ', '.join(f'{kind}: {count}' for kind, count in facts.marks.items())
    tell('marks', marks or 'none')
    for label, text in facts.losses.rows():
        tell(label, text.replace('\n', ' '))
    screen = TerminalScreen(console)
    if facts.changed:
        screen.table(facts.parameters_table())
    screen.table(facts.topics_table())
    for warning in opened.warnings:
        note(console, warning)


def _gap_text(gap: dict[str, float], name: str) -> str:
    value, std = (1e6 * gap.get(key, float('nan')) for key in (name, f'{name}_std'))
    return f'{value:.1f} ± {std:.1f} µm'
