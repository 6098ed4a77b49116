"""`engine-mount ls` and `info`: which recordings there are, and what one of them is."""

from typing import Annotated

from engine_mount.cli.commands.options import (
    Dbc,
    Decimal,
    Delimiter,
    JsonFile,
    RecordingPlace,
    argument,
    new_screen,
    stated,
    write_figures,
)
from engine_mount.cli.fetching import local, named

EPILOG = """Exit code: 0, also when a recording is damaged, which its line shows; 2 when a folder does not
exist.

Examples:

`engine-mount ls` - the recordings in bags, the newest first

`engine-mount ls bags /data/drives --json recordings.json` - of several folders

The verdict is that of the run's summary, as `drive` printed it. A recording without a summary is `whole`
when nothing of its files is missing; `engine-mount audit` checks further.
"""

INFO_EPILOG = """Exit code: 0 when the recording could be read, with any content; 2 when not.

Examples:

`engine-mount info bags/first`

`engine-mount info RECORDING --json info.json`

`engine-mount info MEASURED.mf4` - of a foreign file: its columns with units, rates and ranges

Parameters that a run sets by itself (bus, folder, lock-step) are left out. The exit code of `engine-mount
audit` shows whether a loss is an error.
"""


def ls(
    folders: Annotated[
        list[str] | None,
        argument('folders of runs, or runs; default: bags', '[FOLDER]...'),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """List recordings with date, length, scenario, losses and faults."""
    from engine_mount.reports.listing import list_recordings
    from engine_mount.signals.sources.uris import is_local, local_path

    if not all(map(is_local, folders or ())):
        raise ValueError(
            'ls reads folders of this machine; engine-mount info URI fetches one recording of a store'
        )
    screen, places = new_screen(), [local_path(folder) for folder in folders or ['bags']]
    missing = [str(place) for place in places if not place.exists()]
    if missing:
        raise ValueError(f'{", ".join(missing)}: no such folder; engine-mount drive makes bags')
    with screen.console.status('reading'):
        found = list_recordings(places)
    write_figures({'recordings': found}, json_file)
    if not found:
        screen.say(f'no recordings in {", ".join(map(str, places))}')
    for one in found:  # two lines for each, so that paths stay whole in 80 columns
        style = 'yellow' if one['sound'] is False else None
        screen.console.print(f'{one["recording"]}: {one["verdict"]}', style=style, soft_wrap=True)
        started, duration = one['started'] or '', one['duration_s']
        cells = [started[:16].replace('T', ' '), '' if duration is None else f'{duration:.1f} s']
        cells += [one[name] or '' for name in ('scenario', 'mode', 'mount', 'policy')]
        screen.say(f'  {"  ".join(filter(None, cells))}')


def info(
    recording: RecordingPlace,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    json_file: JsonFile = None,
) -> None:
    """Print the content of a recording: session, versions, parameters, topics, gap, losses.

    Of a foreign file, its columns.
    """
    from engine_mount.recordings.recording import open_run
    from engine_mount.reports.listing import describe_measured, describe_recording
    from engine_mount.signals.formats.reading import is_foreign, read

    screen = new_screen()
    place = local(recording, screen)
    with screen.console.status('reading'):
        if is_foreign(place):
            found = describe_measured(read(place, None, stated(dbc, decimal, delimiter)))
        else:
            opened = open_run(place)
            found = describe_recording(opened)
            whole = 'whole' if opened.whole else 'not whole'
            found.rows.insert(0, ('recording', f'{named(opened.path)}, {whole}'))
    for label, text in found.rows:
        screen.say(f'{label:<20}{text}' if label else text)
    for table in found.tables:
        screen.table(table)
    for sentence in found.notes:
        screen.note(sentence)
    write_figures(found.figures, json_file)
