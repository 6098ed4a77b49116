"""`engine-mount edit`: a piece of a recording, and a sound recording out of a cut or damaged one."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import From, RecordingPlace, new_screen, option, seconds
from engine_mount.cli.fetching import beside, local

INCOMPLETE = 3

CUT_EPILOG = """Exit code: 0 when the piece is written and all of it was readable, 1 when a part was not,
2 when nothing was cut.

Examples:

`engine-mount edit cut RECORDING --from 12s --to 20s`

`engine-mount edit cut RECORDING --event switch-on --before 5s --after 10s --out bags/first_switching`

`engine-mount edit cut RECORDING --event 2` - around the second event
"""
RECOVER_EPILOG = f"""Exit code: 0 when nothing of the file is missing in the new recording, {INCOMPLETE} when
something is lost and the rest stands in it, 2 when nothing could be recovered, or for a wrong use of the
command.

Examples:

`engine-mount edit recover bags/first/recording`

`engine-mount edit recover crash/drive_0.mcap --out bags/drive_recovered`

All chunks whose checksum holds are kept, with topics, times, session, metadata and the recorder's report of
its own losses. A last chunk that was cut off is lost. The original is not touched.
"""


def cut(
    recording: RecordingPlace,
    begin: From = '',
    end: Annotated[str, option('end, as --from', 'TIME', None, '--to')] = '',
    event: Annotated[
        str, option('around an event: its number, its kind, or kind:number, as in switch-on:2')
    ] = '',
    before: Annotated[str, option('with --event: time before it', 'TIME')] = '5s',
    after: Annotated[str, option('with --event: time after it', 'TIME')] = '10s',
    out: Annotated[
        Path | None,
        option('folder to create; default: beside the recording, of a URI here, named by the times'),
    ] = None,
) -> None:
    """Cut a piece out of a recording, with its session and other latched topics.

    The times of the messages stay as they were, so the first message may be a session from long before.
    """
    from engine_mount.recordings import edit
    from engine_mount.recordings.events import event_time, find_event
    from engine_mount.recordings.recording import open_run

    if bool(event) == bool(begin or end):
        raise typer.BadParameter('give --from and --to (or one of them), or --event')
    screen = new_screen()
    opened = open_run(local(recording, screen))
    first, last = (seconds(text) if text else None for text in (begin, end))
    reason = ''
    if event:
        found = find_event(opened, event)
        time = event_time(found, opened.time_axis)
        first, last = max(0.0, time - seconds(before)), time + seconds(after)
        reason = f'{found.kind} at {time:.3f} s' + (f': {found.text}' if found.text else '')
    times = f'_{first or 0.0:g}s_' + ('end' if last is None else f'{last:g}s')
    done = edit.cut(opened, out or beside(opened.path, times), first, last, reason)
    around = f' around {reason}' if reason else ''
    screen.say(
        f'{done.messages} messages from {done.begin:.3f} s to {done.end:.3f} s{around}, '
        f'{done.carried} latched ones from before\nrecording  {done.folder}'
    )
    for sentence in (*opened.warnings, *done.losses):
        screen.note(sentence)
    if done.losses:
        raise typer.Exit(1)


def recover(
    recording: RecordingPlace,
    out: Annotated[
        Path | None,
        option('folder of the new recording; default: beside it, of a URI here, `..._recovered`'),
    ] = None,
) -> None:
    """Make a sound recording after a crash or from a bad disk; print kept and lost data."""
    from engine_mount.recordings import edit
    from engine_mount.recordings.recording import recording_place

    screen = new_screen()
    source = recording_place(local(recording, screen))
    target = out or beside(source, '_recovered')
    with screen.bar('recovering', transient=True) as show:
        result = edit.recover(source, target, lambda done, of: show(done / max(of, 1)))
    for sentence in result.notes:
        screen.note(sentence)
    screen.say(f'{result}; it stands in {result.folder}')
    if not result.complete:
        raise typer.Exit(INCOMPLETE)
