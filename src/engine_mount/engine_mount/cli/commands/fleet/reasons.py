"""With which question a fleet tells why recordings have no figures."""

import shlex
from pathlib import Path

from rich.console import Console

from engine_mount.cli.terminal import note


def tell_question(console: Console, what: str, folder: Path, table: str, where: str) -> None:
    """Print the command that lists the recordings of a table `where`, each with its reason."""
    sql = f'select recording, reason from {table} where {where}'
    note(console, f'why {what}: engine-mount fleet query {shlex.quote(str(folder))} "{sql}"')
