"""The example fleet is what it says, and the same bytes each time."""

import hashlib

import pytest

from engine_mount.drives.drive import check_drive
from engine_mount.fleet.example import (
    FEWEST,
    VARIATIONS,
    WHOLE_FLEET,
    ExampleError,
    make_example,
    make_one,
    settings_of,
    whole_fleet,
)


def order_named(folder, name):
    return next(order for order in whole_fleet(folder) if str(order.folder).endswith(name))


def digests(folder):
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in folder.rglob('*')
        if file.is_file()
    }


def test_the_whole_fleet_can_be_driven_and_each_recording_has_a_folder_of_its_own(tmp_path):
    orders = whole_fleet(tmp_path)
    assert len({order.folder for order in orders}) == len(orders) == WHOLE_FLEET
    for order in orders:
        check_drive(settings_of(order), core=True)


def test_longer_drives_can_be_driven_and_a_sweep_ends_at_its_last_frequency(tmp_path):
    for order in whole_fleet(tmp_path, 40.0)[:: len(VARIATIONS)]:
        length = check_drive(settings_of(order), core=True).duration
        sweeps = {'sweep': 18.0, 'sweep_switched': 46.0 / 3.0}
        assert length == pytest.approx(sweeps.get(order.folder.parent.name, 40.0), abs=1e-3)


def test_the_same_order_makes_the_same_bytes(tmp_path):
    for name in ('tip_in/16_without_ramp', 'tip_in/15_two_mounts', 'smooth_road/19_no_data'):
        once, again = (make_one(order_named(tmp_path / place, name)) for place in ('once', 'again'))
        assert digests(once) == digests(again)


@pytest.mark.parametrize('order', [{'recordings': FEWEST - 1}, {'recordings': 201}, {'seconds': 1.0}])
def test_an_order_that_cannot_be_met_is_refused(tmp_path, order):
    with pytest.raises(ExampleError):
        make_example(tmp_path, **order)
    (tmp_path / 'something').touch()
    with pytest.raises(ExampleError, match='not empty'):
        make_example(tmp_path)
