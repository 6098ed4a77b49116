"""What a drive tells while it happens, and how far its bar has come."""

import pytest

from engine_mount.drives.happenings import Happenings
from engine_mount.drives.progress import DriveProgress
from mount_bringup.graph.nodes import CONTROL, SIMULATED, of_mounts
from mount_ros.messages.event import BY_HAND, Mark

DRIVER = {'level': '0', 'sentence': 'link is up', 'samples': '501', 'last_stamp': '7500000000'}
DRIVER |= {'sample_rate': '1000.0', 'lost': '0'}
GAPS = {'rest_gap_um': '507.94', 'rest_gap_std_um': '0.61', 'contact_gap_um': '349.6'}
GAPS |= {'contact_gap_std_um': '0.4', 'offset_current_A': '0.49', 'level': '0', 'sentence': 'gaps'}


class Clock:
    """A clock that stands until it is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def happenings(told, clock) -> Happenings:
    return Happenings(SIMULATED, told.append, clock)


def off_at(stamp: int) -> dict[str, str]:
    return {'level': '0', 'sentence': 'damping off', 'damping_active': 'False', 'last_stamp': str(stamp)}


def test_the_states_of_the_nodes_are_told_before_any_of_them_is_there(happenings, told):
    happenings.begin()
    assert told == ['starting   recorder, driver, sim, init, control']
    assert happenings.states == 'starting: recorder, driver, sim, init, control'


def test_the_states_fit_a_line_of_80_columns_on_the_way_of_every_node(happenings):
    for node in SIMULATED:
        happenings.on_state(node, 'configured')
    for node in SIMULATED:
        happenings.on_state(node, 'activating')
        assert node.name.removeprefix('mount_') in happenings.states
        assert len(happenings.states) <= 80
        happenings.on_state(node, 'active')


def test_many_nodes_are_counted_but_those_that_are_being_activated_are_named():
    nodes = of_mounts(SIMULATED, ('left', 'right'))
    happenings = Happenings(nodes, lambda text: None)
    happenings.on_state(nodes[1], 'activating')
    assert happenings.states == 'starting: 7; activating: left/driver'


def test_all_nodes_active_are_told_once_with_the_time_since_the_start(happenings, told, clock):
    clock.now = 3.2
    for node in SIMULATED:
        happenings.on_state(node, 'active')
    happenings.on_state(CONTROL, 'activating')  # lost and started again
    happenings.on_state(CONTROL, 'active')
    assert told == ['active     all nodes, 3.2 s after the start']


def test_the_gap_is_told_once(happenings, told):
    for _ in range(3):
        happenings.on_report('mount_init', GAPS)
    assert told == ['gap        rest 507.9 ± 0.6 µm, contact 349.6 ± 0.4 µm, offset current 0.49 A']
    assert len(told[0]) <= 80


def test_damping_is_told_with_times_from_the_first_displacement_sample(happenings, told):
    happenings.on_report('mount_driver', DRIVER)
    happenings.on_mark('', Mark(8_000_000_000, 'switch_on', 'damping on at 0.9 mm in the band'))
    happenings.on_report('mount_control', off_at(7_900_000_000))  # from before the mark
    happenings.on_report('mount_control', off_at(8_460_000_000))
    happenings.on_report('mount_control', off_at(9_460_000_000))
    assert told == ['    1.00 s damping on at 0.9 mm in the band', '    1.46 s damping off']


def test_the_damping_of_several_mounts_is_told_from_the_marks_of_their_common_recorder(told):
    happenings = Happenings(of_mounts(SIMULATED, ('left', 'right')), told.append)
    happenings.on_report('left/mount_driver', DRIVER)
    happenings.on_mark('', Mark(8_000_000_000, 'switch_on', 'left: damping on'))
    happenings.on_report('right/mount_control', off_at(8_460_000_000))
    assert happenings.present == 'damping on; nothing lost'
    happenings.on_report('left/mount_control', off_at(8_460_000_000))
    assert told == ['    1.00 s left: damping on', '    1.46 s left: damping off']


def test_damping_that_flutters_is_summed_up(happenings, told, clock):
    happenings.on_report('mount_driver', DRIVER)
    for switch in range(200):
        clock.now = 0.05 * switch
        stamp = 8_000_000_000 + 50_000_000 * switch
        happenings.on_mark('', Mark(stamp, 'switch_on', 'damping on'))
        happenings.on_report('mount_control', off_at(stamp + 20_000_000))
    assert 10 < len(told) < 17
    assert 'more since the line before' in told[-1]
    assert happenings.present == 'damping off, switched on 200 times; nothing lost'


def test_losses_are_counted_over_the_nodes(happenings):
    happenings.on_report('mount_driver', DRIVER | {'lost': '3'})
    happenings.on_report('mount_recorder', {'level': '0', 'sentence': 'recording', 'lost': '4'})
    assert happenings.present == 'no damping yet; 7 samples or messages lost'


def test_samples_that_are_missing_between_the_stamps_are_lost_and_counted_once(told):
    happenings = Happenings(of_mounts(SIMULATED, ('left', 'right')), told.append)
    missing = {'missing./left/displacement': '5', 'missing./right/displacement': '0'}
    missing |= {'missing./left/coil_ripple': '5', 'missing./left/control_trace': '90'}
    happenings.on_report('left/mount_driver', DRIVER | {'lost': '3'})
    happenings.on_report('left/mount_control', off_at(7_500_000_000) | {'bridged': '4'})
    happenings.on_report('mount_recorder', {'level': '1', 'sentence': 'missing', 'lost': '0'} | missing)
    assert happenings.present == 'no damping yet; 5 samples or messages lost'


def test_a_warning_is_told_when_it_begins_and_not_with_each_count(happenings, told, clock):
    happenings.on_report('mount_driver', DRIVER | {'level': '1', 'sentence': 'is mount_control active?'})
    for node in SIMULATED:
        happenings.on_state(node, 'active')
    assert told == ['active     all nodes, 0.0 s after the start']  # before that it may rightly complain
    clock.now = 1.0
    told.clear()
    for lost in range(20):
        happenings.on_report('mount_driver', DRIVER | {'level': '1', 'sentence': f'{lost} samples lost'})
    happenings.on_report('mount_driver', DRIVER | {'level': '2', 'sentence': 'the coil is open'})
    assert told == ['warning    driver: 0 samples lost', 'warning    driver: the coil is open']


def test_marks_by_hand_are_left_to_the_answer_of_the_recorder(happenings, told):
    happenings.on_mark('left', Mark(8_000_000_000, BY_HAND))
    happenings.on_mark('left', Mark(8_000_000_000, 'lost_sample', '/displacement: 1 sample missing'))
    assert told == ['           left: /displacement: 1 sample missing']


def figures(samples: int) -> dict[str, str]:
    return {'samples': str(samples), 'samples_of_run': '5000', 'simulated_s': str(samples / 1000)}


def test_the_bar_begins_at_0_whatever_was_measured_before_and_ends_at_1():
    progress = DriveProgress(figures(3000), real_time=False)
    assert progress.share(figures(3000)) == 0.0
    assert progress.share(figures(4000)) == 0.5
    assert progress.share(figures(5000)) == 1.0


def test_in_real_time_the_bar_goes_on_by_the_clock_but_not_for_long(clock):
    progress = DriveProgress(figures(3000), real_time=True, clock=clock)
    clock.now = 0.5
    assert progress.share(figures(3000)) == pytest.approx(0.25)
    assert progress.share(figures(4000)) == 0.5
    clock.now = 60.0
    assert progress.share(figures(4000)) < 1.3


def test_a_bar_of_a_drive_that_is_over_at_once_is_full():
    assert DriveProgress(figures(5000), real_time=False).share(figures(5000)) == 1.0
    assert DriveProgress({}, real_time=True).share({'samples': '1'}) == 1.0
