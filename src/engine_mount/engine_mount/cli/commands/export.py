"""`engine-mount export`: signals for other programs, and the control law for the electronics, in C."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    OUTPUT,
    RecordingPlace,
    changes_of,
    new_screen,
    option,
    target,
)
from engine_mount.cli.fetching import local
from engine_mount.cli.help import named, setting

SIGNALS_EPILOG = """Exit code: 0 when the file is written, 2 when it is refused, with the reason.

Examples:

`engine-mount export signals bags/first --out first.csv` - all signals, units in the titles

`engine-mount export signals bags/first --signal displacement.mount --signal current --out first.mat`

A row is a sample of the displacement, or without it of the signal that has most. Other signals hold their
last value. `engine-mount import` reads the file again.
"""
C_EPILOG = """Exit code: 0 when both files are written, 1 with the reason when not.

Examples:

`engine-mount export c --out law`

`engine-mount export c --out law --policy switched_viscous --set damper=viscous_3000`
"""


def signals(
    recording: RecordingPlace,
    out: Annotated[Path, option('file to write: .csv, .parquet or .mat', 'FILE', panel=OUTPUT, check=target)],
    signal: Annotated[
        list[str] | None, option('a signal, as topic.field; may be repeated; default: all', 'NAME')
    ] = None,
) -> None:
    """Write signals of a recording as CSV, Parquet or MATLAB, one table with times in s."""
    from engine_mount.recordings.recording import recording_place
    from engine_mount.signals.exporting import export

    screen = new_screen()
    place = recording_place(local(recording, screen))
    with screen.console.status('reading'):
        summary = export(place, out, signal or ())
    screen.say(f'exported   {summary}')
    screen.say(f'file       {out}')


def c(
    out: Annotated[Path, option('folder of both files, which are overwritten', 'FOLDER')],
    policy: Annotated[str, option('policy instead of that of the parameters', 'NAME', named('policy'))] = '',
    parameters: Annotated[
        Path | None, option('parameter file of ROS 2, of which mount_control is taken', 'FILE')
    ] = None,
    settings: Annotated[
        list[str] | None, option('parameter of mount_control', '[NODE.]NAME=VALUE', setting, '--set')
    ] = None,
) -> None:
    """Write the control law in C, for electronics that compute the current themselves.

    `engine_mount_controller.h` and `.c` are C11 without a library. They are made from the functions that
    mount_control runs, and answer each sample to the bit as it does.
    """
    from engine_mount.export.controller_in_c import write_controller
    from engine_mount.settings.chosen import check_effect
    from mount_bringup.parameter_file import settings_of_file
    from mount_bringup.settings import checked_settings, defaults_of_nodes

    values = settings_of_file(parameters, '', defaults_of_nodes()) if parameters else {}
    changes = changes_of(settings)
    if others := {*changes} - {'mount_control'}:
        raise typer.BadParameter(
            f'--set of {", ".join(others)}: the law has parameters of mount_control only'
        )
    control = {**values.get('mount_control', {}), **changes.get('mount_control', {})}
    control |= {'policy': policy} if policy else {}
    check_effect(control)
    for path in write_controller(checked_settings({'mount_control': control}), out):
        new_screen().say(str(path))
