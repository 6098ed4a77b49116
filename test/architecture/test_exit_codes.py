"""One table of exit codes holds for all commands, and says of each what it promises."""

import re

from command_line import commands
from sources import REPOSITORY

PAGE = REPOSITORY / 'docs' / 'reference' / 'exit_codes.md'


def _rows() -> dict[str, str]:
    """Return {command: its row} of the page."""
    rows = [line for line in PAGE.read_text(encoding='utf-8').splitlines() if line.startswith('| `')]
    return {name: row for row in rows for name in re.findall(r'`([\w ]+)`', row.split('|')[1])}


def test_every_command_has_its_row():
    names = {words if words.startswith(('dev ', 'edit ')) else words.split()[0] for words in commands()}
    assert _rows().keys() == names
