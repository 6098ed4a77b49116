"""The tables of the README say what the code says."""

from pathlib import Path

from mount_models.quantity import quantities
from mount_sim.electronics.faults import FAULTS
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import MOUNTS

README = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')
OWN = ('timeline', 'bench', 'motorway', 'sweep', 'recorded', 'idle', 'tip_in', 'electronics', 'temperature')


def rows(parameters, prefix=''):
    """The rows of the table for the numbers of a parameter set."""
    for name, note in quantities(parameters).items():
        default = getattr(parameters, name)
        if not isinstance(default, int | float):
            continue
        yield (
            f'| `{prefix}{name}` | {default:g} | {note.unit} '
            f'| {note.low:g} .. {note.high:g} | {note.meaning} |'
        )


def test_every_number_that_can_be_set_is_listed_with_default_unit_range_and_meaning():
    listed = README.splitlines()
    for row in [
        *rows(SimParameters()),
        *(row for part in OWN for row in rows(getattr(SimParameters(), part), f'{part}.')),
    ]:
        assert row in listed


def test_every_fault_is_listed():
    for name, kind in FAULTS.items():
        assert f'| `{name}` | {kind.meaning} |' in README.splitlines()


def test_every_mount_is_listed():
    for name, meaning in MOUNTS.items():
        assert f'| `{name}` | {meaning} |' in README.splitlines()
