"""Writes docs/reference/commands.md: every command with arguments, options and examples, as in its help.

`python test/docs/commands_page.py` renews the page; `test_generated_pages.py` holds it against the commands.
"""

import re
from collections.abc import Iterator

import typer
from generated import PAGES, table, written_by
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

from engine_mount.cli.command import app

PAGE = PAGES / 'commands.md'

HEAD = f"""# Commands

What `engine-mount COMMAND --help` tells. {written_by(__file__)}
What each command promises by its exit code: [exit codes](exit_codes.md); what else is to know of it:
[engine_mount.cli](../../src/engine_mount/engine_mount/cli/README.md#commands).
"""
WORDS = {'int': 'NUMBER', 'float': 'NUMBER', 'str': 'TEXT', 'path': 'PATH'}
"""What stands for a value where the option does not name it itself."""


def page() -> str:
    """Return the text of the page."""
    commands = list(commands_below(typer.main.get_command(app)))
    parts = [HEAD, table(('command', 'does'), [summary(name, command) for name, command in commands])]
    for name, command in commands:
        parts += section(name, command)
    return '\n\n'.join(part.rstrip() for part in parts) + '\n'


def commands_below(command: object, name: str = '') -> Iterator[tuple[str, TyperCommand]]:
    """Yield (name, command) of all that can be called, those of groups behind the name of their group."""
    if isinstance(command, TyperGroup):
        for part, below in sorted(command.commands.items()):
            yield from commands_below(below, f'{name} {part}'.strip())
    elif isinstance(command, TyperCommand):
        yield name, command


def summary(name: str, command: TyperCommand) -> tuple[str, str]:
    """Return the row of the first table."""
    return f'[{name}](#{name.replace(" ", "-")})', paragraphs(command)[0]


def section(name: str, command: TyperCommand) -> Iterator[str]:
    """Yield the parts of the page about one command."""
    shown = [each for each in command.params if not getattr(each, 'hidden', False)]
    arguments = [each for each in shown if isinstance(each, TyperArgument)]
    options = [each for each in shown if isinstance(each, TyperOption) and each.name != 'help']
    yield f'## {name}'
    yield '\n\n'.join(paragraphs(command))
    if arguments:
        yield table(('argument', 'default', 'meaning'), map(argument_row, arguments))
    if options:
        yield table(('option', 'default', 'meaning'), map(option_row, options))
    if command.epilog:
        yield '\n\n'.join(map(example, command.epilog.strip().split('\n\n')))


def paragraphs(command: TyperCommand) -> list[str]:
    """Return what a command says of itself."""
    return [' '.join(part.split()) for part in (command.help or '').split('\n\n')]


def argument_row(argument: TyperArgument) -> tuple[str, str, str]:
    """Return the row of an argument."""
    name = (argument.metavar or argument.name or '').upper()
    name = name if argument.nargs == 1 else f'{name.removesuffix("...")}...'
    return f'`{name}`', '' if argument.required else default_of(argument), argument.help or ''


def option_row(option: TyperOption) -> tuple[str, str, str]:
    """Return the row of an option."""
    names = ' / '.join(f'`{name}`' for name in (*option.opts, *option.secondary_opts))
    if not option.is_flag:
        names = f'{names[:-1]} {option.metavar or value_word(option)}`'
    return names, default_of(option), option.help or ''


def value_word(option: TyperOption) -> str:
    """Return what stands for the value of an option."""
    return WORDS[option.bare_type().lower().removeprefix('list[').removesuffix(']')]


def default_of(parameter: TyperArgument | TyperOption) -> str:
    """Return the default of a parameter, empty where there is none or its help tells it."""
    value = parameter.default
    if value is None or value is False or value in ('', [], ()) or callable(value):
        return ''
    if value is True:
        return f'`{parameter.opts[0]}`'
    return f'{value:g}' if isinstance(value, (int, float)) else f'`{value}`'


def example(paragraph: str) -> str:
    """Return a paragraph of the examples: a command with its meaning becomes an item of a list."""
    text = ' '.join(paragraph.split())
    found = re.fullmatch(r'`(engine-mount .*?)`(?: - (.*))?', text)
    if found is None:
        return text
    return f'- `{found[1]}`' + (f': {found[2]}' if found[2] else '')


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
