"""Each fault does what its name says, while it lasts and no longer."""

import math

import numpy as np
import pytest

from mount_driver.can_library import can
from mount_driver.protocol import MountCodec, Status
from mount_models.quantity import ParameterError
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults.kinds import FAULTS
from mount_sim.electronics.faults.schedule import Faults, check_without_bus
from mount_sim.plant.plant import Plant

BEGIN, END = 2.0, 2.5
TIMES = (1.999, 2.0, 2.25, 2.499, 2.5)
PRESENT = (False, True, True, True, False)
READING = Reading(1e-3, 0.5, 250.0, 80.0)
SOUND = Status(14.0, 20.0, e2e_error=True)
CODEC = MountCodec()
OF_READINGS = [name for name in FAULTS if name.startswith(('displacement_', 'ripple_'))][:-1]


class Timed:
    """Faults looked at sample by sample."""

    def __init__(self, *texts):
        self.faults = Faults(texts, seed=1)

    def at(self, time):
        if self.faults.due(time):
            self.faults.look(time)
        return self.faults


def _told(name):
    return Timed(f'{name}@{BEGIN}:{END - BEGIN}')


@pytest.fixture
def frame():
    """Return a function that makes a sound measurement frame."""
    bus = can.Bus(interface='virtual', channel='test_faults', protocol=can.CanProtocol.CAN_FD)
    end = CanEnd(bus)
    yield lambda number: end.measurement_frame(number, 1000 * number, READING, enabled=True)
    end.close()


def _counter(frame):
    """The sample counter of a frame, None if it is damaged."""
    layout = CODEC.measurement
    return layout.decode(frame.data)[1].sample_counter if layout.is_sound(frame.data) else None


def _arriving(name, frame, count=1000):
    """The frames that arrive of so many during the fault, by the sample in which they do."""
    faults = _told(name).at(BEGIN)
    return [faults.through('frames', [frame(number)]) for number in range(count)]


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('fire@1', r"fault 'fire' is unknown; known are can_silent, bus_off, .* gap_blocked"),
        ('coil_open', r"fault 'coil_open' is not written as NAME@t\[:duration\], times in s"),
        ('coil_open@', 'is not written as'),
        ('coil_open@-1', 'is not written as'),
        ('coil_open@nan', 'is not written as'),
        ('coil_open@1:2:3', 'is not written as'),
        ('coil_open@1.2.3', r'must lie within 0 \.\. 7200 s'),
        ('coil_open@7201', r'a time \(7201 s\) must lie within 0 \.\. 7200 s'),
        ('coil_open@1:0', 'its duration must be longer than 0 s'),
    ],
)
def test_what_is_no_fault_is_refused(text, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Faults([text])


def test_a_fault_lasts_as_long_as_it_is_told():
    for name in set(FAULTS) - {'counter_wrap', 'electronics_reset'}:
        timed = _told(name)
        assert tuple(bool(timed.at(time).present) for time in TIMES) == PRESENT, name


def test_a_fault_without_a_duration_stays():
    timed = Timed('coil_open@2')
    assert [bool(timed.at(time).present) for time in (1.999, 2.0, 7000.0)] == [False, True, True]


def test_several_faults_are_there_at_once_and_each_ends_by_itself():
    timed = Timed('coil_half@1', 'over_current@2:1', 'displacement_invalid@2:2')
    carried = [timed.at(time).through('current', 1.0) for time in (0.0, 1.0, 2.0, 3.0, 4.0)]
    assert carried == [1.0, 0.5, 0.5, 0.5, 0.5]
    timed = Timed('coil_half@1', 'over_current@2:1', 'displacement_invalid@2:2')
    seen = [
        (
            timed.at(time).through('status', SOUND).over_current,
            math.isnan(timed.at(time).through('reading', READING).displacement),
        )
        for time in (1.0, 2.0, 3.0, 4.0)
    ]
    assert seen == [(False, False), (True, True), (False, True), (False, False)]


def test_without_a_fault_everything_is_as_it_was(frame):
    faults = Timed().at(5.0)
    sent = [frame(0)]
    assert faults.present == ()
    assert not faults.deaf
    assert faults.through('frames', sent) is sent
    assert faults.through('reading', READING) is READING
    assert faults.through('status', SOUND) is SOUND
    assert faults.through('counters', (7, 7000)) == (7, 7000)


def test_injected_faults_begin_with_the_next_sample_and_end_when_told_or_over():
    timed = Timed('coil_half@9')
    assert timed.at(1.0).present == ()
    assert timed.faults.inject('coil_open, over_current:2') == 'begun: coil_open, over_current for 2 s'
    over = [
        (timed.at(time).through('current', 1.0), timed.at(time).through('status', SOUND).over_current)
        for time in (1.001, 3.0, 3.1)
    ]
    assert over == [(0.0, True), (0.0, True), (0.0, False)]
    assert timed.faults.end_injected() == 'ended: coil_open, over_current'
    assert timed.at(3.2).through('current', 1.0) == 1.0
    assert timed.at(9.0).through('current', 1.0) == 0.5  # what was told before the run is still to come
    assert timed.faults.end_injected() == 'no fault was injected'


@pytest.mark.parametrize('text', ['', ' , ', 'fire', 'coil_open@3', 'counter_wrap', 'coil_open; deaf'])
def test_what_cannot_be_injected_is_refused_and_changes_nothing(text):
    timed = Timed()
    with pytest.raises(ParameterError):
        timed.faults.inject(text)
    assert timed.at(1.0).present == ()


def test_what_shows_on_the_bus_only_is_refused_without_one():
    check_without_bus(['coil_open@3', 'displacement_step@2:1'])
    with pytest.raises(ParameterError, match='fault lost_5 shows on the CAN bus only'):
        check_without_bus(['coil_open@3', 'lost_5@2:1'])


# The bus.


def test_only_a_deaf_end_and_one_that_is_off_lose_setpoints():
    deaf = [name for name in FAULTS if _told(name).at(BEGIN).deaf]
    assert deaf == ['bus_off', 'deaf', 'electronics_reset']


@pytest.mark.parametrize('name', [name for name in FAULTS if name not in OF_READINGS])
def test_other_faults_leave_the_readings_alone(name):
    assert _told(name).at(BEGIN).through('reading', READING) == READING


def test_silent_electronics_send_nothing(frame):
    assert _arriving('can_silent', frame) == [[]] * 1000


def test_a_bus_that_is_off_tells_so_once(frame):
    first, *others = _arriving('bus_off', frame)
    assert [(error.is_error_frame, error.arbitration_id) for error in first] == [(True, 0x40)]
    assert others == [[]] * 999


@pytest.mark.parametrize(('name', 'share'), [('lost_1', 0.01), ('lost_5', 0.05), ('lost_50', 0.5)])
def test_a_share_of_the_frames_is_lost_and_the_same_ones_again(frame, name, share):
    arrived = [len(frames) for frames in _arriving(name, frame, 10000)]
    assert 1.0 - np.mean(arrived) == pytest.approx(share, rel=0.2)
    assert [len(frames) for frames in _arriving(name, frame, 10000)] == arrived


@pytest.mark.parametrize(('name', 'late'), [('delayed', 5), ('delayed_50', 50)])
def test_delayed_frames_arrive_whole_and_late(frame, name, late):
    arrived = _arriving(name, frame)
    assert arrived[:late] == [[]] * late
    assert [_counter(one) for (one,) in arrived[late:]] == list(range(1000 - late))


def test_duplicated_frames_arrive_twice(frame):
    assert [[_counter(one) for one in two] for two in _arriving('duplicated', frame, 3)] == [
        [0, 0],
        [1, 1],
        [2, 2],
    ]


def test_every_tenth_frame_is_overtaken_and_none_is_lost(frame):
    order = [_counter(one) for frames in _arriving('reordered', frame, 31) for one in frames]
    assert order[8:12] == [8, 10, 9, 11]
    assert sorted(order) == list(range(31))


def test_a_frozen_counter_has_a_sound_check_sum_and_goes_on_measuring(frame):
    decoded = [CODEC.measurement.decode(one.data) for (one,) in _arriving('frozen_counter', frame, 300)]
    assert {alive for alive, _ in decoded} == {0}
    assert [sample.sample_counter for _, sample in decoded] == list(range(300))


@pytest.mark.parametrize(('name', 'length'), [('wrong_crc', 24), ('wrong_length', 20)])
def test_every_third_frame_is_damaged(frame, name, length):
    arrived = _arriving(name, frame, 9)
    assert [_counter(one) for (one,) in arrived] == [None, 1, 2, None, 4, 5, None, 7, 8]
    assert len(arrived[3][0].data) == arrived[3][0].dlc == length


def test_old_frames_come_once_more_as_they_were(frame):
    arrived = _arriving('replayed', frame, 300)
    assert [len(frames) for frames in arrived] == [1] * 100 + [2] * 200
    again = [frames[1].data for frames in arrived[100:]]
    assert again == [frames[0].data for frames in arrived[:200]]


def test_foreign_frames_come_besides_and_none_has_an_identifier_of_ours(frame):
    arrived = _arriving('babbling', frame)
    assert [_counter(frames[0]) for frames in arrived] == list(range(1000))
    foreign = {one.arbitration_id for frames in arrived for one in frames[1:]}
    assert all(len(frames) == 6 for frames in arrived)
    assert len(foreign) > 1000
    assert not foreign & {CODEC.measurement.frame_id, CODEC.setpoint.frame_id, CODEC.status.frame_id}


# Clock and counters.


def _counts(timed, samples):
    return [timed.at(1e-3 * sample).through('counters', (sample, 1000 * sample)) for sample in samples]


def test_a_clock_jumps_ahead_while_the_fault_lasts():
    assert _counts(_told('clock_jump'), (1999, 2000, 2499, 2500)) == [
        (1999, 1_999_000),
        (2000, 12_000_000),
        (2499, 12_499_000),
        (2500, 2_500_000),
    ]


def test_a_clock_drifts_from_the_beginning_of_the_fault_on():
    assert _counts(Timed('clock_drift@2'), (1999, 2000, 3000, 12000)) == [
        (1999, 1_999_000),
        (2000, 2_000_000),
        (3000, 3_001_000),
        (12000, 12_010_000),
    ]


def test_counters_wrap_at_the_told_time():
    counts = _counts(Timed('counter_wrap@70'), (0, 69_999, 70_000, 70_001))
    assert [(sample & 0xFFFF, us & 0xFFFFFFFF) for sample, us in counts[1:]] == [
        (0xFFFF, 0xFFFFFFFF - 999),
        (0, 0),
        (1, 1000),
    ]
    assert counts[0] == (0x10000 - 70_000 % 0x10000, (1 << 32) - 70_000_000)


def test_electronics_without_power_are_off_and_begin_anew(frame):
    timed = Timed('electronics_reset@2')
    seen = []
    for sample in (1999, 2000, 2099, 2100, 2101):
        faults = timed.at(1e-3 * sample)
        count = faults.through('counters', (sample, 1000 * sample))
        seen.append(
            (
                *count,
                faults.restarts,
                faults.deaf,
                faults.through('current', 1.0),
                len(faults.through('frames', [frame(0)])),
            )
        )
    assert seen == [
        (1999, 1_999_000, False, False, 1.0, 1),
        (2000, 2_000_000, False, True, 0.0, 0),
        (2099, 2_099_000, False, True, 0.0, 0),
        (0, 0, True, False, 1.0, 1),
        (1, 1000, False, False, 1.0, 1),
    ]


# Sensors.


def _read(timed, times=TIMES):
    return [timed.at(time).through('reading', READING._replace(displacement=1e-3 * time)) for time in times]


@pytest.mark.parametrize(
    ('name', 'displacements'),
    [
        ('displacement_invalid', [1.999e-3, math.nan, math.nan, math.nan, 2.5e-3]),
        ('displacement_stuck', [1.999e-3, 2e-3, 2e-3, 2e-3, 2.5e-3]),
        ('displacement_step', [1.999e-3, 4e-3, 4.25e-3, 4.499e-3, 2.5e-3]),
        ('displacement_out_of_range', [1.999e-3, 0.045, 0.045, 0.045, 2.5e-3]),
        ('displacement_inverted', [1.999e-3, -2e-3, -2.25e-3, -2.499e-3, 2.5e-3]),
        ('displacement_flipped', [1.999e-3, -2e-3, -2.25e-3, -2.499e-3, 2.5e-3]),
        ('displacement_drifting', [1.999e-3, 2.001e-3, 2.252e-3, 2.502e-3, 2.5e-3]),
    ],
)
def test_what_the_displacement_sensor_gives(name, displacements):
    readings = _read(_told(name))
    assert [reading.displacement for reading in readings] == pytest.approx(displacements, nan_ok=True)
    assert all(reading[1:] == READING[1:] for reading in readings)


def test_a_noisy_displacement_scatters_about_what_is_there():
    faults = Timed('displacement_noisy@0').at(0.0)
    noise = [faults.through('reading', READING).displacement - READING.displacement for _ in range(2000)]
    assert np.std(noise) == pytest.approx(0.3e-3, rel=0.1)
    assert np.mean(noise) == pytest.approx(0.0, abs=0.03e-3)


def test_a_missing_ripple_leaves_displacement_and_current():
    timed = _told('ripple_missing')
    for time, present in zip(TIMES, PRESENT, strict=True):
        reading = timed.at(time).through('reading', READING)
        assert (math.isnan(reading.current_rate), math.isnan(reading.flux_rate)) == (present, present)
        assert reading[:2] == READING[:2]


def test_a_ripple_of_wrong_scale_or_with_noise():
    assert Timed('ripple_scale@0').at(0.0).through('reading', READING) == READING._replace(current_rate=325.0)
    faults = Timed('ripple_noisy@0').at(0.0)
    read = np.array([faults.through('reading', READING) for _ in range(2000)])
    ratio = read[:, 3] / read[:, 2] / (READING.flux_rate / READING.current_rate)
    assert np.std(ratio) == pytest.approx(0.2, rel=0.15)
    assert np.all(read[:, :2] == READING[:2])


# Power stage and status.


@pytest.mark.parametrize(
    ('name', 'carried'),
    [
        ('over_current', [1.0, 1.0, 2.0, 0.0, 1.0]),
        ('coil_open', [1.0, 0.0, 0.0, 0.0, 1.0]),
        ('coil_half', [1.0, 0.5, 1.0, 0.0, 1.0]),
        ('coil_stuck', [1.0, 3.0, 3.0, 3.0, 1.0]),
        ('coil_stuck_on', [1.0, 1.0, 1.0, 1.0, 1.0]),
    ],
)
def test_what_the_coil_carries(name, carried):
    timed = _told(name)
    wanted = (1.0, 1.0, 2.0, 0.0, 1.0)
    assert [
        timed.at(time).through('current', current) for time, current in zip(TIMES, wanted, strict=True)
    ] == carried


@pytest.mark.parametrize(
    ('name', 'told'),
    [
        ('coil_open', {}),
        ('over_current', {'over_current': True}),
        ('over_temperature', {'over_temperature': True}),
        ('under_voltage', {'under_voltage': True}),
        ('displacement_sensor', {'displacement_sensor': True}),
        ('temperature_250', {'coil_temperature_celsius': 250.0}),
        ('supply_0', {'supply_voltage': 0.0}),
        ('supply_5', {'supply_voltage': 5.0}),
        ('supply_9', {'supply_voltage': 9.0}),
        ('supply_16', {'supply_voltage': 16.0}),
        ('supply_24', {'supply_voltage': 24.0}),
    ],
)
def test_what_the_status_says(name, told):
    faulty = SOUND._replace(**told)
    timed = _told(name)
    said = [timed.at(time).through('status', SOUND) for time in TIMES]
    assert said == [faulty if present else SOUND for present in PRESENT]


# The plant.


@pytest.mark.parametrize(
    ('name', 'part', 'changed'),
    [
        ('coil_shorted', 'coil', {'resistance': 1.25}),
        ('coil_shorted', 'actuator', {'turns': 240.0}),
        ('supply_0', 'coil', {'link_voltage': 0.05}),
        ('supply_9', 'coil', {'link_voltage': 9.0}),
        ('pads_worn', 'mechanics', {'contact_gap': 200e-6}),
        ('pads_missing', 'mechanics', {'contact_gap': 20e-6}),
        ('pads_missing', 'friction', {'scale': 0.0}),
        ('gap_blocked', 'mechanics', {'spring_stiffness': 1e9}),
    ],
)
def test_what_changes_in_the_plant(name, part, changed):
    plant = Plant()
    faulty = _told(name).at(BEGIN).through('plant', plant)
    assert getattr(faulty, part) == getattr(plant, part)._replace(**changed)


def test_a_hot_coil_is_told_as_hot_as_it_is():
    plant, faults = Plant(), _told('coil_hot').at(BEGIN)
    celsius = faults.through('plant', plant).electronics.coil_temperature
    assert 1.0 + plant.temperature.copper * (celsius - 20.0) == pytest.approx(1.4)
    assert faults.through('status', SOUND).coil_temperature_celsius == celsius


@pytest.mark.parametrize(
    ('name', 'gap', 'force', 'rubs'),
    [
        ('pads_worn', 200e-6, 30.0, True),
        ('pads_missing', 3e-6, 300.0, False),
        ('gap_blocked', 508e-6, 0.0, False),
        ('coil_shorted', 349e-6, 1.0, True),
        ('coil_open', 508e-6, 0.0, False),
        ('supply_0', 508e-6, 0.0, False),
    ],
)
def test_what_the_actuator_does(make_mount, name, gap, force, rubs):
    mount = make_mount(faults=(f'{name}@0.1',), bench__amplitude=1e-3)
    frictions = []
    while not mount.finished:
        mount.measure()
        if mount.time > 0.2:
            frictions.append(abs(mount.truth['friction_force']))
        mount.advance(1.0)
    assert mount.truth['gap'] == pytest.approx(gap, rel=0.3, abs=10e-6)
    assert mount.truth['normal_force'] >= force
    assert bool(max(frictions) > 1.0) is rubs


def test_a_plant_is_sound_again_behind_its_fault(make_mount):
    faulty, sound = make_mount(faults=('gap_blocked@0.05:0.05',)), make_mount()
    for _ in range(290):
        for mount in (faulty, sound):
            mount.measure()
            mount.advance(1.0)
    assert faulty.truth['gap'] == pytest.approx(sound.truth['gap'], rel=1e-9)
    assert faulty.truth['normal_force'] == pytest.approx(sound.truth['normal_force'], rel=1e-9)
