"""What a replay takes other than recorded: the option, and the changes that it says."""

from typing import Annotated, Any

import typer

from engine_mount.cli.completion import setting

OtherThanRecorded = Annotated[
    list[str] | None,
    typer.Option(
        '--set',
        metavar='[NODE.]NAME=VALUE',
        help='a parameter other than recorded, of mount_control or mount_init; may be repeated',
        autocompletion=setting,
    ),
]


def changes_of(settings: list[str]) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of NAME=VALUE, or raise `BadParameter` or a `ValueError`."""
    from engine_mount.drives.replay import parsed_changes
    from engine_mount.settings.options import settings_of_options
    from mount_bringup.settings import SettingError

    try:
        given = settings_of_options(settings)
    except SettingError as error:
        raise typer.BadParameter(str(error)) from None
    return parsed_changes(given)
