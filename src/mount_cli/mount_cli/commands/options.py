"""Options that several sub-commands have."""

from pathlib import Path
from typing import Annotated

import typer

from mount_cli.completion.values import setting

NewFolder = Annotated[Path | None, typer.Option(help='folder to create; default: a new one in bags')]
JsonFile = Annotated[
    Path | None, typer.Option('--json', metavar='FILE', help='write all figures to this file')
]
Split = Annotated[
    list[str] | None,
    typer.Option(metavar='LIMIT', help='largest or longest file: 500MB, 60s; may be given once for each'),
]
Snapshot = Annotated[
    str, typer.Option(metavar='DURATION', help='record only around events, with so much before: 30s')
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        '--set',
        metavar='[NODE.]NAME=VALUE',
        help='any parameter of any node; may be repeated',
        autocompletion=setting(),
    ),
]
Domain = Annotated[int | None, typer.Option(help='ROS domain; default: ROS_DOMAIN_ID or 0')]
Namespace = Annotated[str, typer.Option(help='namespace of the mount, such as mount_right')]
