"""`engine-mount report`: one page about one or several recordings."""

from pathlib import Path
from typing import Annotated

from engine_mount.cli.commands.options import RecordingPlaces, new_screen, option
from engine_mount.cli.fetching import beside, is_fetched, local, named
from engine_mount.cli.help import recordings as offered

EPILOG = """Exit code: 0 when the page is written, also about a damaged recording; 2 when nothing can be read.

Examples:

`engine-mount report bags/first` - beside the recording, in its run folder

`engine-mount report bags/first --compare bags/second --out difference.html` - with the differences

`engine-mount report drive_1 drive_2 drive_3 --out three.html --png pictures` - in the same charts
"""


def report(
    recordings: RecordingPlaces,
    other: Annotated[
        str | None,
        option('draw this recording too, with its differences from the first', 'OTHER', offered, '--compare'),
    ] = None,
    out: Annotated[
        Path | None, option('the page; default: report.html in or beside the run, of a URI here', 'FILE')
    ] = None,
    pictures: Annotated[
        Path | None,
        option('folder of the PNGs; default: beside the page, by its name', 'FOLDER', None, '--png'),
    ] = None,
) -> None:
    """Write one HTML page that works without network, and its charts as PNG.

    Several recordings share the charts. The page names the missing parts of a recording.
    """
    from engine_mount.reports.report import default_page, default_pictures
    from engine_mount.reports.report import report as make_report

    screen = new_screen()
    places = [local(recording, screen) for recording in recordings]
    compared = None if other is None else local(other, screen)
    first = places[0]
    file = out or (beside(first, '_report.html') if is_fetched(first) else default_page(first))
    folder = pictures or default_pictures(file)
    with screen.bar('reading', transient=True) as show:
        made = make_report(places, compare_with=compared, out=file, pictures=folder, on_step=show)
    for failure in made.failures:
        screen.note(failure)
    for subject in made.subjects:
        for warning in subject.recording.warnings:
            screen.note(f'{named(subject.recording.path)}: {warning}')
    screen.say(f'report     {file}')
    drawn = f'{len(made.pictures)} in {folder}' if made.pictures else 'none, there is nothing to draw'
    screen.say(f'pictures   {drawn}')
