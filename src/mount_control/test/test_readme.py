"""The tables of the README say what the code says."""

from pathlib import Path

from mount_control.settings import FRICTION, parameter_sets
from mount_models.quantity import quantities

README = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')


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
    for prefix, parameters in parameter_sets():
        if prefix not in FRICTION:
            for row in rows(parameters, prefix and f'{prefix}.'):
                assert row in listed
