"""Collects the names that a shell offers; `python test/docs/parameters_page.py` writes them."""

import json
import math
from collections.abc import Mapping
from typing import Any

from engine_mount.cli.bench.bench import GROUPS
from engine_mount.experiments.registry import ALL, experiment_named
from engine_mount.experiments.registry import listed as listed_experiments
from engine_mount.faults.case import MATRIX
from mount_bringup.settings import defaults_of_nodes
from mount_control.policy.registry import POLICIES
from mount_control.settings import parameter_sets
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.damper import DAMPERS
from mount_models.quantity import quantities
from mount_recorder.diagnosis import OnFull
from mount_recorder.parameters import RecorderParameters
from mount_ros.topics import TOPICS
from mount_sim.electronics.faults.kinds import FAULTS
from mount_sim.excitation.scenario import SCENARIO_NAMES
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import MOUNTS
from mount_sim.plant.places import PLACES

_WORDS = ('scenario', 'mount', 'policy', 'damper', 'on_full')
"""Kinds of names that are the values of the parameter of the same name."""


def collected() -> str:
    """Return the text of `names.json`: {kind: {name: meaning}}, and default and meaning of each parameter."""
    experiments = {name: f'{reference}: {title}' for name, reference, title in listed_experiments()}
    names: dict[str, Any] = {
        'words': _WORDS,
        'scenario': dict.fromkeys(SCENARIO_NAMES, ''),
        'mount': {name: meaning.replace('`', '') for name, meaning in MOUNTS.items()},
        'place': dict.fromkeys(PLACES, ''),
        'policy': dict.fromkeys(POLICIES, ''),
        'damper': dict.fromkeys(DAMPERS, ''),
        'on_full': dict.fromkeys((word.value for word in OnFull), ''),
        'fault': {name: kind.meaning for name, kind in FAULTS.items()},
        'case': {name: case.meaning for name, case in MATRIX.items()},
        'group': dict.fromkeys(GROUPS, ''),
        'topic': {topic.name: topic.type for topic in TOPICS},
        'experiment': {**experiments, ALL: ''},
        'parameters': {
            **{node: _told(values, _meanings()) for node, values in defaults_of_nodes().items()},
            **{
                owner: _told(values, {})
                for name in experiments
                for owner, values in experiment_named(name).known_settings().items()
            },
        },
    }
    return json.dumps(names, indent=1, ensure_ascii=False) + '\n'


def _meanings() -> dict[str, str]:
    """Return {name: unit and meaning} of the numbers of all nodes."""
    sets = [DriverParameters(), InitParameters(), SimParameters(), RecorderParameters()]
    found: dict[str, str] = {}
    for prefix, given in [*(('', each) for each in sets), *parameter_sets()]:
        _add(found, prefix, given)
    return found


def _add(found: dict[str, str], prefix: str, given: Any) -> None:
    before = f'{prefix}.' if prefix else ''
    for name, note in quantities(given).items():
        found[before + name] = f'{note.unit}: {note.meaning}'
    for name, value in given._asdict().items():
        if hasattr(value, '_asdict'):
            _add(found, before + name, value)


def _told(values: Mapping[str, Any], meanings: Mapping[str, str]) -> dict[str, str]:
    return {name: f'{_text(value)}\t{meanings.get(name, "")}' for name, value in values.items()}


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value
    return repr(value) if isinstance(value, (int, float)) and math.isfinite(value) else ''
