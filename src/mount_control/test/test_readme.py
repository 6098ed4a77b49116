"""The tables of the README say what the code says."""

from pathlib import Path

from readme_rows import readme_rows

from mount_control.settings import FRICTION, parameter_sets

README = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')


def test_every_number_that_can_be_set_is_listed_with_default_unit_range_and_meaning():
    listed = README.splitlines()
    for prefix, parameters in parameter_sets():
        if prefix not in FRICTION:
            for row in readme_rows(parameters, prefix and f'{prefix}.'):
                assert row in listed
