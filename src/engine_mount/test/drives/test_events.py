"""What a drive shows of its events while it runs."""

import pytest

from engine_mount.drives.events import DriveEvents
from mount_bringup.graph.nodes import CONTROL, SIMULATED, of_mounts
from mount_ros.messages.event import BY_HAND, Mark

DRIVER = {'level': '0', 'sentence': 'link is up', 'samples': '501', 'last_stamp': '7500000000'}
DRIVER |= {'sample_rate': '1000.0', 'lost': '0'}
GAPS = {'contact_gap_um': '349.6', 'level': '0', 'sentence': 'contact gap 349.6 um'}


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
def events(told, clock) -> DriveEvents:
    return DriveEvents(SIMULATED, told.append, clock)


def off_at(stamp: int, mount: str = '') -> dict[str, str]:
    figures = {f'damping_off{mount}': str(stamp), 'last_stamp': str(stamp + 40_000_000)}
    return {'level': '0', 'sentence': 'recording', **figures}


def test_the_states_of_the_nodes_are_told_before_any_of_them_is_there(events, told):
    events.begin()
    assert told == ['starting   recorder, driver, sim, init, control']
    assert events.states == 'starting: recorder, driver, sim, init, control'


def test_the_states_fit_a_line_of_80_columns_on_the_way_of_every_node(events):
    for node in SIMULATED:
        events.on_state(node, 'configured')
    for node in SIMULATED:
        events.on_state(node, 'activating')
        assert node.name.removeprefix('mount_') in events.states
        assert len(events.states) <= 80
        events.on_state(node, 'active')


def test_all_nodes_active_are_told_once_with_the_time_since_the_start(events, told, clock):
    clock.now = 3.2
    for node in SIMULATED:
        events.on_state(node, 'active')
    events.on_state(CONTROL, 'activating')  # lost and started again
    events.on_state(CONTROL, 'active')
    assert told == ['active     all nodes, 3.2 s after the start']


def test_the_gap_is_told_once(events, told):
    for _ in range(3):
        events.on_report('mount_init', GAPS)
    assert told == ['gap        contact gap 349.6 um']


def test_damping_is_told_with_times_from_the_first_displacement_sample(events, told):
    events.on_report('mount_driver', DRIVER)
    events.on_mark('', Mark(8_000_000_000, 'switch_on', 'damping on at 0.9 mm in the band'))
    events.on_report('mount_recorder', off_at(7_900_000_000))  # from before the mark
    events.on_report('mount_recorder', off_at(8_460_000_000) | {'last_stamp': '8499000000'})  # a short pause
    assert events.damping == 'damping on'
    events.on_report('mount_recorder', off_at(8_460_000_000))
    events.on_report('mount_recorder', off_at(9_460_000_000))
    assert told == ['    1.00 s damping on at 0.9 mm in the band', '    1.46 s damping off']


def test_the_damping_of_several_mounts_is_told_from_the_marks_of_their_common_recorder(told):
    events = DriveEvents(of_mounts(SIMULATED, ('left', 'right')), told.append)
    events.on_report('left/mount_driver', DRIVER)
    events.on_mark('', Mark(8_000_000_000, 'switch_on', 'left: damping on'))
    events.on_report('mount_recorder', off_at(8_460_000_000, '.right'))
    assert events.damping == 'damping on'
    events.on_report('mount_recorder', off_at(8_460_000_000, '.left'))
    assert told == ['    1.00 s left: damping on', '    1.46 s left: damping off']


def test_damping_that_flutters_is_summed_up(events, told, clock):
    events.on_report('mount_driver', DRIVER)
    for switch in range(200):
        clock.now = 0.05 * switch
        stamp = 8_000_000_000 + 50_000_000 * switch
        events.on_mark('', Mark(stamp, 'switch_on', 'damping on'))
        events.on_report('mount_recorder', off_at(stamp + 20_000_000))
    assert 10 < len(told) < 17
    assert 'more since the line before' in told[-1]
    assert events.damping == 'damping off, switched on 200 times'


def test_a_warning_is_told_when_it_begins_and_not_with_each_count(events, told, clock):
    events.on_report('mount_driver', DRIVER | {'level': '1', 'sentence': 'is mount_control active?'})
    for node in SIMULATED:
        events.on_state(node, 'active')
    assert told == ['active     all nodes, 0.0 s after the start']  # before that it may rightly complain
    clock.now = 1.0
    told.clear()
    for lost in range(20):
        events.on_report('mount_driver', DRIVER | {'level': '1', 'sentence': f'{lost} samples lost'})
    events.on_report('mount_driver', DRIVER | {'level': '2', 'sentence': 'the coil is open'})
    assert told == ['warning    driver: 0 samples lost', 'warning    driver: the coil is open']


def test_marks_by_hand_are_left_to_the_answer_of_the_recorder(events, told):
    events.on_mark('left', Mark(8_000_000_000, BY_HAND))
    events.on_mark('left', Mark(8_000_000_000, 'recording_loss', '5 messages not recorded'))
    assert told == ['           left: 5 messages not recorded']
