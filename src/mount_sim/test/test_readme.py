"""The tables of the README say what the code says."""

from pathlib import Path

from readme_rows import readme_rows

from mount_sim.electronics.faults import FAULTS
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import MOUNTS

README = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')
OWN = ('timeline', 'bench', 'motorway', 'sweep', 'recorded', 'idle', 'tip_in', 'electronics', 'temperature')


def test_every_number_that_can_be_set_is_listed_with_default_unit_range_and_meaning():
    listed = README.splitlines()
    for row in [
        *readme_rows(SimParameters()),
        *(row for part in OWN for row in readme_rows(getattr(SimParameters(), part), f'{part}.')),
    ]:
        assert row in listed


def test_every_fault_is_listed():
    for name, kind in FAULTS.items():
        assert f'| `{name}` | {kind.meaning} |' in README.splitlines()


def test_every_mount_is_listed():
    for name, meaning in MOUNTS.items():
        assert f'| `{name}` | {meaning} |' in README.splitlines()
