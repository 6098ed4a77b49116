"""`engine-mount record`: the recorder alone, beside a graph or without one."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from engine_mount.cli.commands.options import Domain, Namespace, NewFolder, Split, option
from engine_mount.cli.completion import named
from engine_mount.cli.terminal import terminal

EPILOG = """Exit code: 0 when nothing is known to be lost, also after Ctrl-C, which is the normal end; 1 on
loss, when the disk was full, or when nothing could be recorded; 2 for a wrong use of the command.

Examples:

`engine-mount record` - all topics, until Ctrl-C; `m` or space sets a mark

`engine-mount record displacement control_trace --split 500MB --out bags/long`

In a terminal a line tells messages per second, size, lost messages and marks. The topic `event`, which
holds the marks, is always recorded. Times are those of the wall clock.
"""


def record(
    topics: Annotated[
        list[str] | None,
        typer.Argument(
            metavar='[TOPIC]...', help='names of the registry; default: all', autocompletion=named('topic')
        ),
    ] = None,
    out: NewFolder = None,
    split: Split = '',
    duration: Annotated[float | None, option('length, s; default: until Ctrl-C', 'S')] = None,
    on_full: Annotated[
        str,
        option(
            'full disk: stop, or continue without recording until the end is asked for',
            'WORD',
            named('on_full'),
        ),
    ] = 'stop',
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Record topics until Ctrl-C; exit code 1 if anything was lost."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.drives.record import record as run_record
    from engine_mount.settings.amounts import checked_recorder, recorder_options
    from engine_mount.settings.run_folder import new_place
    from mount_bringup.graph.domain import chosen_domain

    if duration is not None and not duration > 0.0:
        raise typer.BadParameter(f'--duration ({duration:g} s) must be above 0')
    options = {'on_full': on_full, **recorder_options(split)}
    console = terminal()
    folder = out if out is not None else new_place('record')
    outcome = run_record(
        folder,
        checked_recorder(options),
        TerminalScreen(console),
        topics=topics or (),
        duration=duration,
        domain=chosen_domain(domain),
        namespace=namespace,
    )
    if outcome.failure:
        _print('note', outcome.failure, console)
    sound = _told(folder, console)
    if outcome.failure or outcome.lost or not sound:
        raise typer.Exit(1)


def _told(folder: Path, console: Console) -> bool:
    """Print what is there of a recording; return whether anything is, and nothing known to be lost."""
    from engine_mount.recordings.audit import audit
    from engine_mount.recordings.losses import losses, sentences
    from engine_mount.recordings.recording import open_recording

    recording = open_recording(folder)
    audits = audit(recording)
    found = losses(recording, audits)
    for warning in recording.warnings:
        _print('note', warning, console)
    came = any(entry.present for name, entry in audits.items() if name != '/diagnostics')
    if came:
        _print('audit', sentences(audits, found)[-1], console)
    else:
        nothing = 'nothing was recorded, save perhaps /diagnostics'
        _print('note', f'{nothing}; does a graph run in this domain, namespace?', console)
    _print('recording', folder, console)
    return came and found.lossless


def _print(word: str, what: Any, console: Console) -> None:
    console.print(f'{word:<10} {what}', soft_wrap=True)
