"""Writes src/mount_bringup/config/vehicle.yaml: every setting of a vehicle, explained, most of them at rest.

`python test/docs/parameters_page.py` renews the file; `test_vehicle_file.py` holds it against the code.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from parameters_page import SETS, notes_of

from mount_bringup.graph.nodes import VEHICLE
from mount_bringup.settings import defaults_of_nodes
from mount_models.quantity import Quantity

FILE = Path(__file__).resolve().parents[2] / 'src' / 'mount_bringup' / 'config' / 'vehicle.yaml'

GIVEN: dict[str, dict[str, Any]] = {
    'mount_recorder': {'on_full': 'continue'},
    'mount_driver': {'interface': 'socketcan', 'channel': 'can0'},
    'mount_init': {'specimen': ''},
    'mount_control': {'continuous_viscous.eigenfrequency': 8.0},
}
"""What this vehicle gives its nodes; all else is there as a comment with the default."""

HEAD = """\
# The settings of one vehicle, for `ros2 launch mount_bringup vehicle.launch.py config:=FILE`. This is the
# example, and what is taken without `config`: copy it for each vehicle and change the copy.
#
# Every setting is here; behind its value its unit, its range and what it means. A line that begins with #
# shows a default and sets nothing: take the # away to set it. Arguments of the launch file that are given
# win over this file. A name that no node has and a value out of range are refused before a process starts.
#
# What stands here is for all mounts of the vehicle. Values of one mount: two_mounts.yaml.
"""


def text() -> str:
    """Return the text of the file."""
    known = defaults_of_nodes()
    return (
        '\n'.join([HEAD, *(line for node in VEHICLE for line in _node(node.name, known[node.name]))]) + '\n'
    )


def _node(node: str, defaults: dict[str, Any]) -> Iterator[str]:
    notes = {name: note for prefix, given in SETS[node] for name, note in notes_of(given, prefix)}
    yield from (f'/**/{node}:', '  ros__parameters:')
    for name, default in defaults.items():
        given = GIVEN[node].get(name)
        setting = f'{name}: {_value(default if given is None else given)}'
        yield f'    {"# " if given is None else ""}{setting}  # {_meaning(notes[name])}'
    yield ''


def _value(value: Any) -> str:
    if isinstance(value, str):
        return f"'{value}'"
    return '.nan' if isinstance(value, float) and math.isnan(value) else repr(value)


def _meaning(note: Quantity) -> str:
    return f'{note.unit}{f", {note.limits}" if note.limits else ""}: {note.meaning}'
