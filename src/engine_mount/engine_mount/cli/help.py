"""How `--help` shows options and arguments: by words of this project instead of types of Python."""

from typing import Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

_WORDS = {
    'bool': '',
    'int': 'NUMBER',
    'float': 'NUMBER',
    'str': 'TEXT',
    'path': 'PATH',
}


class Command(TyperCommand):
    """A sub-command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters with words for what they take."""
        return [_worded(parameter, ctx) for parameter in super().get_params(ctx)]

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return what stands behind the name of the command in its usage: options, then arguments."""
        arguments = [each for each in self.get_params(ctx) if isinstance(each, TyperArgument)]
        return ['[OPTIONS]', *map(_in_usage, arguments)]


class Group(TyperGroup):
    """A command with sub-commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters with words for what they take."""
        return [_worded(parameter, ctx) for parameter in super().get_params(ctx)]


def group(name: str, text: str) -> typer.Typer:
    """Return a command with sub-commands, and its help `text`."""
    return typer.Typer(cls=Group, name=name, help=text, no_args_is_help=True, rich_markup_mode='markdown')


def _worded(parameter: Any, ctx: Any) -> Any:
    if isinstance(parameter, TyperArgument):
        if parameter.metavar is None:
            parameter.metavar = parameter.name.upper() + ('...' if parameter.nargs != 1 else '')
        parameter.display_type_rich = lambda ctx: ''  # type: ignore[method-assign]
    elif isinstance(parameter, TyperOption) and parameter.metavar is None:
        kind = parameter.display_type(ctx).strip('<>').removeprefix('list[').removesuffix(']')
        parameter.metavar = _WORDS.get(kind.removesuffix(' range').lower(), kind)
    return parameter


def _in_usage(parameter: TyperArgument) -> str:
    name = parameter.display_name_raw
    return name if parameter.required or name.startswith('[') else f'[{name}]'
