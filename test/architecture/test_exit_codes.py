"""One table of exit codes holds for all commands, and says of each what it promises."""

import re

from sources import REPOSITORY

from engine_mount.cli.command import app

PAGE = REPOSITORY / 'docs' / 'reference' / 'exit_codes.md'


def _rows() -> dict[str, str]:
    """Return {command: its row} of the page."""
    rows = [line for line in PAGE.read_text(encoding='utf-8').splitlines() if line.startswith('| `')]
    return {name: row for row in rows for name in re.findall(r'`(\w+)`', row.split('|')[1])}


def test_every_command_has_its_row():
    names = {each.name or each.callback.__name__ for each in app.registered_commands}
    groups = {each.name or each.typer_instance.info.name for each in app.registered_groups}
    assert _rows().keys() == names | groups
