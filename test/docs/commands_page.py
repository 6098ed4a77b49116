"""Writes docs/reference/commands.md: every command with arguments, options and examples, as in its help.

`python test/docs/commands_page.py` renews the page; `test_generated_pages.py` holds it against the commands.
"""

import re

import typer
from generated import PAGES, written_by
from typer.cli import get_docs_for_click

from engine_mount.cli.command import app

PAGE = PAGES / 'commands.md'

HEAD = f"""# Commands

The output of `engine-mount COMMAND --help`. {written_by(__file__)}
The promise of each command by its exit code: [exit codes](exit_codes.md); more about each command:
[engine_mount.cli](../../src/engine_mount/engine_mount/cli/README.md#commands).
"""


def page() -> str:
    """Return the text of the page."""
    command = typer.main.get_command(app)
    with command.make_context('engine-mount', [], resilient_parsing=True) as context:
        text = get_docs_for_click(obj=command, ctx=context, name='engine-mount', title='Commands')
    # what a usage shows is no command to type
    text = re.sub(r'\*\*Usage\*\*:\n\n```console\n\$ (.*?)\n```', r'`\1`', text)
    return re.sub(r'\n{3,}', '\n\n', text.replace('# Commands\n', HEAD, 1)).rstrip() + '\n'


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
