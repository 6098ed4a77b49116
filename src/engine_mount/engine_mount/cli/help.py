"""What `--help` and Tab show: words of this project, names from the code, runs from folders."""

import os
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
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


class _Worded:
    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters with words for what they take."""
        return [_worded(parameter, ctx) for parameter in super().get_params(ctx)]  # type: ignore[misc]


class Command(_Worded, TyperCommand):
    """A sub-command."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return what stands behind the name of the command in its usage: options, then arguments."""
        arguments = [each for each in self.get_params(ctx) if isinstance(each, TyperArgument)]
        return ['[OPTIONS]', *map(_in_usage, arguments)]


class Group(_Worded, TyperGroup):
    """A command with sub-commands."""


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


Completer = Callable[[str], list[str]]

KINDS = {
    'scenario': 'mount_sim.excitation.scenario:SCENARIO_NAMES',
    'mount': 'mount_sim.plant.mounts:MOUNTS',
    'place': 'mount_sim.plant.mounts:PLACES',
    'policy': 'mount_control.policy.registry:POLICIES',
    'on_full': 'mount_recorder.diagnosis:OnFull',
    'fault': 'mount_sim.electronics.faults:FAULTS',
    'case': 'engine_mount.faults.case:MATRIX',
    'group': 'engine_mount.cli.bench:GROUPS',
    'topic': 'mount_ros.topics:TOPICS',
    'experiment': 'engine_mount.experiments.registry:NAMES',
}
"""Module and collection of the names of each kind; only that module is loaded, for Tab is pressed often."""
_BAGS = Path('bags')


def named(kind: str) -> Completer:
    """Return the completer of names of a kind, such as `scenario`, behind the last comma or slash."""

    def offer(incomplete: str) -> list[str]:
        module, _, collection = KINDS[kind].partition(':')
        before = incomplete[: max(map(incomplete.rfind, ',/')) + 1]
        names = getattr(import_module(module), collection)
        texts = (getattr(each, 'value', getattr(each, 'name', each)) for each in names)
        return _beginning(incomplete, (before + text for text in texts))

    return offer


def setting(incomplete: str) -> list[str]:
    """Offer the parameters of the nodes for `--set`, with their defaults to be overwritten."""
    from mount_bringup.settings import defaults_of_nodes

    settings = (
        f'{owner}.{parameter}={str(default).lower() if isinstance(default, bool) else default}'
        for owner, parameters in defaults_of_nodes().items()
        for parameter, default in parameters.items()
    )
    return _beginning(incomplete, settings)


def recordings(incomplete: str) -> list[str]:
    """Offer runs and recordings in `bags`, or beside what is begun, the newest first."""
    base = Path(incomplete).parent if os.sep in incomplete else _BAGS
    found = [path for path in (base.iterdir() if base.is_dir() else ()) if _is_recording(path)]
    found.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    return _beginning(incomplete, map(str, found))


def _is_recording(path: Path) -> bool:
    return path.suffix == '.mcap' or any(
        (place / 'metadata.yaml').is_file() for place in (path, path / 'recording')
    )


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
