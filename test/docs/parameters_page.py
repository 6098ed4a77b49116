"""Writes docs/reference/parameters.md: every parameter of every node, as the code declares it.

`python test/docs/parameters_page.py` renews the page and the file of `vehicle_file.py`; tests hold both
against the code.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from generated import PAGES, page_of

from mount_bringup.settings import defaults_of_nodes
from mount_control.settings import parameter_sets
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.quantity import Quantity, quantities
from mount_models.specimen_choice import SpecimenChoice
from mount_recorder.parameters import RecorderParameters
from mount_sim.parameters import NodeParameters, SimParameters

PAGE = PAGES / 'parameters.md'
SETS: dict[str, list[tuple[str, Any]]] = {
    'mount_driver': [('', DriverParameters()), ('', SpecimenChoice())],
    'mount_sim': [('', SimParameters()), ('', NodeParameters())],
    'mount_init': [('', InitParameters()), ('', SpecimenChoice())],
    'mount_control': parameter_sets(),
    'mount_recorder': [('', RecorderParameters())],
}
"""The parameter sets of each node, behind their prefix."""

HEAD = """# Parameters

Every parameter of every node, as `--set NODE.NAME=VALUE` of `engine-mount`, `ros2 param` and the files
in `src/mount_bringup/config` take it. `python test/docs/parameters_page.py` writes this page from the
declarations, and a test holds it against them. *Source* says where a default is from: the paper, a
derivation, or a choice of this project. Every node has `lockstep` too (true: time stands in the stamps
alone). The meaning of texts stands in the README of the package.
"""


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for node, defaults in defaults_of_nodes().items():
        notes = {name: note for prefix, given in SETS[node] for name, note in notes_of(given, prefix)}
        parts += [
            f'## {node}',
            f'README: [{node}](../../src/{node}/README.md#parameters).',
            '\n'.join(
                [
                    '| parameter | default | unit | range | meaning | source |',
                    '|---|---|---|---|---|---|',
                    *(row(name, default, notes[name]) for name, default in defaults.items()),
                ]
            ),
        ]
    return page_of(parts)


def notes_of(parameters: NamedTuple, prefix: str) -> Iterator[tuple[str, Quantity]]:
    """Return (full name, note) of every number of a set and of the sets in it."""
    before = f'{prefix}.' if prefix else ''
    yield from ((f'{before}{name}', note) for name, note in quantities(parameters).items())
    for name, value in parameters._asdict().items():
        if hasattr(value, '_asdict'):
            yield from notes_of(value, f'{before}{name}')


def row(name: str, default: Any, note: Quantity) -> str:
    """Return the row of one parameter."""
    if isinstance(default, bool):
        value = str(default).lower()
    elif isinstance(default, (int, float)):
        value = 'unknown' if math.isnan(default) else f'{default:g}'
    else:
        value = f'`{default}`' if default else 'empty'
    return f'| `{name}` | {value} | {note.unit} | {note.limits} | {note.meaning} | {note.source} |'


if __name__ == '__main__':
    from vehicle_file import FILE, text  # which is made of the same sets

    PAGE.write_text(page(), encoding='utf-8')
    FILE.write_text(text(), encoding='utf-8')
