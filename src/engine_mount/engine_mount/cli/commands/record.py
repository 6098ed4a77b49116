"""`engine-mount record`: the recorder alone, beside a graph or without one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from engine_mount.cli.commands.options import (
    Domain,
    Namespace,
    NewFolder,
    Split,
    argument,
    new_screen,
    option,
)
from engine_mount.cli.help import named

if TYPE_CHECKING:
    from engine_mount.cli.screen import TerminalScreen

EPILOG = """Exit code: 0 when nothing is known to be lost, also after Ctrl-C, which is the normal end; 1 on
loss, when the disk was full, or when nothing could be recorded; 2 for a wrong use of the command.

Examples:

`engine-mount record` - all topics, until Ctrl-C; `m` or space sets a mark

`engine-mount record displacement control_trace --split 500MB --out bags/long`

In a terminal a line shows messages per second, size, lost messages and marks. The topic `event`, which
holds the marks, is always recorded. Times are those of the wall clock.
"""


def record(
    topics: Annotated[
        list[str] | None, argument('names of the registry; default: all', '[TOPIC]...', named('topic'))
    ] = None,
    out: NewFolder = None,
    split: Split = '',
    duration: Annotated[float | None, option('length, s; default: until Ctrl-C', 'S')] = None,
    on_full: Annotated[
        str,
        option(
            'full disk: stop, or continue without recording until the end is requested',
            'WORD',
            named('on_full'),
        ),
    ] = 'stop',
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Record topics until Ctrl-C; exit code 1 if anything was lost."""
    from engine_mount.drives.record import record as run_record
    from engine_mount.settings.options import checked_recorder, recorder_options
    from engine_mount.settings.run_folder import new_place
    from mount_bringup.graph.domain import chosen_domain

    if duration is not None and not duration > 0.0:
        raise typer.BadParameter(f'--duration ({duration:g} s) must be above 0')
    options = {'on_full': on_full, **recorder_options(split)}
    screen, folder = new_screen(), out or new_place('record')
    outcome = run_record(
        folder, checked_recorder(options), screen, topics=topics or (),
        duration=duration, domain=chosen_domain(domain), namespace=namespace,
    )  # fmt: skip
    if outcome.failure:
        screen.note(outcome.failure)
    sound = _print_losses(folder, screen)
    if outcome.failure or outcome.lost or not sound:
        raise typer.Exit(1)


def _print_losses(folder: Path, screen: 'TerminalScreen') -> bool:
    """Print what is there of a recording; return whether anything is, and nothing known to be lost."""
    from engine_mount import audit
    from engine_mount.recordings.recording import open_recording

    found = audit(open_recording(folder))
    for warning in found.warnings:
        screen.note(warning)
    came = any(entry.present for name, entry in found.topics.items() if name != '/diagnostics')
    if came:
        screen.say(f'audit      {found.sentences()[-1]}')
    else:
        screen.note(
            'nothing was recorded, save perhaps /diagnostics; does a graph run in this domain, namespace?'
        )
    screen.say(f'recording  {folder}')
    return came and found.losses.lossless
