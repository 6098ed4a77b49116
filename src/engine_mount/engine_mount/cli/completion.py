"""The values that a shell offers behind Tab for options and arguments, from the code and from folders."""

import os
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path

Completer = Callable[[str], list[str]]

KINDS = {
    'scenario': 'mount_sim.excitation.scenario:SCENARIO_NAMES',
    'mount': 'mount_sim.plant.mounts:MOUNTS',
    'place': 'mount_sim.plant.mounts:PLACES',
    'policy': 'mount_control.policy.registry:POLICIES',
    'damper': 'mount_models.damper:DAMPERS',
    'on_full': 'mount_recorder.diagnosis:OnFull',
    'fault': 'mount_sim.electronics.faults:FAULTS',
    'case': 'engine_mount.faults.case:MATRIX',
    'group': 'engine_mount.cli.bench.bench:GROUPS',
    'topic': 'mount_ros.topics:TOPICS',
    'experiment': 'engine_mount.experiments.registry:NAMES',
}
"""Module and collection of the names of each kind; only that module is loaded, for Tab is pressed often."""
_BAGS = Path('bags')


def named(kind: str) -> Completer:
    """Return the completer of one name of a kind, such as `scenario`."""
    return lambda incomplete: _beginning(incomplete, _names(kind))


def listed(kind: str) -> Completer:
    """Return the completer of names of a kind with commas between them."""

    def offer(incomplete: str) -> list[str]:
        before, comma, last = incomplete.rpartition(',')
        used = before.split(',')
        return [before + comma + name for name in _beginning(last, _names(kind)) if name not in used]

    return offer


def setting(incomplete: str) -> list[str]:
    """Offer the parameters of the nodes for `--set`, with their defaults to be overwritten."""
    name, equals, word = incomplete.partition('=')
    if equals:
        kind = name.rpartition('.')[2]
        return [f'{name}={known}' for known in _beginning(word, _names(kind) if kind in KINDS else [])]
    from mount_bringup.settings import defaults_of_nodes

    settings = [
        f'{owner}.{parameter}={str(default).lower() if isinstance(default, bool) else default}'
        for owner, parameters in defaults_of_nodes().items()
        for parameter, default in parameters.items()
    ]
    return _beginning(incomplete, settings)


def faults(incomplete: str) -> list[str]:
    """Offer the faults of the simulator; when they begin has to be written behind the `@`."""
    mount, slash, name = incomplete.rpartition('/')
    return [mount + slash + known for known in _beginning(name, ['list', *_names('fault')])]


def recordings(incomplete: str) -> list[str]:
    """Offer runs and recordings in `bags`, or beside what is begun, the newest first."""
    base = Path(incomplete).parent if os.sep in incomplete else _BAGS
    found = [path for path in (base.iterdir() if base.is_dir() else ()) if _is_recording(path)]
    found.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    return _beginning(incomplete, map(str, found))


def references(incomplete: str) -> list[str]:
    """Offer the references that there are."""
    folder = _BAGS / 'reference'
    return _beginning(incomplete, sorted(path.name for path in folder.iterdir()) if folder.is_dir() else [])


def _is_recording(path: Path) -> bool:
    return path.suffix == '.mcap' or any(
        (place / 'metadata.yaml').is_file() for place in (path, path / 'recording')
    )


def _names(kind: str) -> list[str]:
    """Return the names of a kind: of keys, or of what has a `value` or a `name`."""
    module, _, collection = KINDS[kind].partition(':')
    known = getattr(import_module(module), collection)
    return [getattr(each, 'value', getattr(each, 'name', each)) for each in known]


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
