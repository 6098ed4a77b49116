"""`engine-mount export c`: the control law for electronics that compute the current themselves."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import changes_of, option
from engine_mount.cli.help import named, setting

EPILOG = """Exit code: 0 when both files are written, 1 with the reason when not.

Examples:

`engine-mount export c --out law`

`engine-mount export c --out law --policy switched_viscous --set damper=viscous_3000`
"""


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
    from engine_mount.cli.terminal import terminal
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
        terminal().print(str(path), soft_wrap=True)
