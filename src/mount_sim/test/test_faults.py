"""Each fault does what its name says, while it lasts and no longer."""

import math

import numpy as np
import pytest
from simulated_mounts import make_mount

from mount_driver.can_library import can
from mount_driver.protocol import MountCodec, Status
from mount_models.quantity import ParameterError
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults import FAULTS, Faults, check_without_bus
from mount_sim.plant.plant import Plant

BEGIN, END = 2.0, 2.5
TIMES = (1.999, 2.0, 2.25, 2.499, 2.5)
PRESENT = (False, True, True, True, False)
READING = Reading(1e-3, 0.5, 250.0, 80.0)
SOUND = Status(14.0, 20.0, e2e_error=True)
CODEC = MountCodec()
OWN = {CODEC.measurement.frame_id, CODEC.setpoint.frame_id, CODEC.status.frame_id}


class Timed:
    """Faults looked at sample by sample."""

    def __init__(self, *texts):
        self.faults = Faults(texts, seed=1)

    def at(self, time):
        if self.faults.due(time):
            self.faults.look(time)
        return self.faults


def _begun(name):
    return Timed(f'{name}@{BEGIN}:{END - BEGIN}')


def _changed(name, part, values):
    """Return what becomes of `values` at `TIMES`."""
    timed = _begun(name)
    return [timed.at(time).through(part, value) for time, value in zip(TIMES, values, strict=True)]


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


def _arriving(name, frame, count=300):
    """The frames that arrive of so many during the fault, by the sample in which they do."""
    faults = _begun(name).at(BEGIN)
    return [faults.through('frames', [frame(number)]) for number in range(count)]


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('fire@1', r"fault 'fire' is unknown; known are can_silent, bus_off, .* gap_blocked"),
        ('coil_open', r"fault 'coil_open' is not written as NAME@t\[:duration\], times in s"),
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


def test_each_fault_lasts_as_long_as_its_text_says_and_without_a_duration_stays():
    for name in set(FAULTS) - {'counter_wrap', 'electronics_reset'}:
        timed = _begun(name)
        assert tuple(bool(timed.at(time).present) for time in TIMES) == PRESENT, name
    timed = Timed('coil_open@2')
    assert [bool(timed.at(time).present) for time in (1.999, 2.0, 7000.0)] == [False, True, True]


def test_several_faults_are_there_at_once_and_each_ends_by_itself():
    timed = Timed('coil_half@1', 'over_current@2:1', 'displacement_invalid@2:2')
    seen = [
        (
            faults.through('current', 1.0),
            faults.through('status', SOUND).over_current,
            math.isnan(faults.through('reading', READING).displacement),
        )
        for faults in map(timed.at, (1.0, 2.0, 3.0, 4.0))
    ]
    assert seen == [(0.5, False, False), (0.5, True, True), (0.5, False, True), (0.5, False, False)]


def test_injected_faults_begin_with_the_next_sample_and_end_at_their_end_or_on_request():
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
    assert timed.at(9.0).through('current', 1.0) == 0.5  # a fault from before the run is still to come
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


def test_only_a_deaf_end_and_one_that_is_off_lose_setpoints():
    assert [name for name in FAULTS if _begun(name).at(BEGIN).deaf] == [
        'bus_off', 'deaf', 'electronics_reset',
    ]  # fmt: skip


ARRIVING = {
    'can_silent': lambda k: [],
    'bus_off': lambda k: [None] if k == 0 else [],
    'delayed': lambda k: [k - 5] if k >= 5 else [],
    'delayed_50': lambda k: [k - 50] if k >= 50 else [],
    'duplicated': lambda k: [k, k],
    'reordered': lambda k: [] if k % 10 == 9 else [k, k - 1] if k and k % 10 == 0 else [k],
    'frozen_counter': lambda k: [k],
    'wrong_crc': lambda k: [k if k % 3 else None],
    'wrong_length': lambda k: [k if k % 3 else None],
    'replayed': lambda k: [k, k - 100] if k >= 100 else [k],
    'babbling': lambda k: [k] + [None] * 5,
}
"""Counters of the frames that arrive in sample k; None: damaged or foreign."""


@pytest.mark.parametrize('name', ARRIVING)
def test_which_frames_arrive_in_each_sample(frame, name):
    arrived = _arriving(name, frame)
    assert [[_counter(one) for one in frames] for frames in arrived] == [
        ARRIVING[name](k) for k in range(300)
    ]


def test_what_faulty_frames_are_like(frame):
    (error,) = _arriving('bus_off', frame)[0]
    assert (error.is_error_frame, error.arbitration_id) == (True, 0x40)
    alive = {CODEC.measurement.decode(one.data)[0] for (one,) in _arriving('frozen_counter', frame)}
    assert len(alive) == 1
    (short,) = _arriving('wrong_length', frame)[3]
    assert len(short.data) == short.dlc == 20
    foreign = {one.arbitration_id for frames in _arriving('babbling', frame) for one in frames[1:]}
    assert len(foreign) > 300
    assert not foreign & OWN


@pytest.mark.parametrize(('name', 'share'), [('lost_1', 0.01), ('lost_5', 0.05), ('lost_50', 0.5)])
def test_a_share_of_the_frames_is_lost_and_the_same_ones_again(frame, name, share):
    arrived = [len(frames) for frames in _arriving(name, frame, 10000)]
    assert 1.0 - np.mean(arrived) == pytest.approx(share, rel=0.2)
    assert [len(frames) for frames in _arriving(name, frame, 10000)] == arrived


@pytest.mark.parametrize(
    ('text', 'counts'),
    [
        ('clock_jump@2:0.5', {1999: 1_999_000, 2000: 12_000_000, 2499: 12_499_000, 2500: 2_500_000}),
        ('clock_drift@2', {1999: 1_999_000, 2000: 2_000_000, 3000: 3_001_000, 12000: 12_010_000}),
    ],
)
def test_what_the_clock_of_the_electronics_says(text, counts):
    timed = Timed(text)
    for sample, us in counts.items():
        assert timed.at(1e-3 * sample).through('counters', (sample, 1000 * sample)) == (sample, us)


def test_counters_wrap_at_the_time_of_the_fault():
    timed = Timed('counter_wrap@70')
    counts = [
        timed.at(1e-3 * sample).through('counters', (sample, 1000 * sample))
        for sample in (0, 69_999, 70_000, 70_001)
    ]
    assert [(sample & 0xFFFF, us & 0xFFFFFFFF) for sample, us in counts[1:]] == [
        (0xFFFF, 0xFFFFFFFF - 999),
        (0, 0),
        (1, 1000),
    ]
    assert counts[0] == (0x10000 - 70_000 % 0x10000, (1 << 32) - 70_000_000)


def test_electronics_without_power_are_off_and_begin_anew(frame):
    timed, seen = Timed('electronics_reset@2'), []
    for sample in (1999, 2000, 2099, 2100, 2101):
        faults = timed.at(1e-3 * sample)
        count = faults.through('counters', (sample, 1000 * sample))
        sent = len(faults.through('frames', [frame(0)]))
        seen.append((*count, faults.restarts, faults.deaf, faults.through('current', 1.0), sent))
    assert seen == [
        (1999, 1_999_000, False, False, 1.0, 1),
        (2000, 2_000_000, False, True, 0.0, 0),
        (2099, 2_099_000, False, True, 0.0, 0),
        (0, 0, True, False, 1.0, 1),
        (1, 1000, False, False, 1.0, 1),
    ]


@pytest.mark.parametrize(
    ('name', 'within'),
    [
        ('displacement_invalid', [math.nan] * 3),
        ('displacement_stuck', [2e-3] * 3),
        ('displacement_step', [4e-3, 4.25e-3, 4.499e-3]),
        ('displacement_out_of_range', [0.045] * 3),
        ('displacement_inverted', [-2e-3, -2.25e-3, -2.499e-3]),
        ('displacement_flipped', [-2e-3, -2.25e-3, -2.499e-3]),
        ('displacement_drifting', [2.001e-3, 2.252e-3, 2.502e-3]),
    ],
)
def test_what_the_displacement_sensor_gives(name, within):
    readings = _changed(name, 'reading', [READING._replace(displacement=1e-3 * time) for time in TIMES])
    expected = [1.999e-3, *within, 2.5e-3]
    assert [reading.displacement for reading in readings] == pytest.approx(expected, nan_ok=True)
    assert all(reading[1:] == READING[1:] for reading in readings)


def test_noise_has_its_size():
    faults = Timed('displacement_noisy@0').at(0.0)
    noise = [faults.through('reading', READING).displacement - READING.displacement for _ in range(2000)]
    assert np.std(noise) == pytest.approx(0.3e-3, rel=0.1)
    assert np.mean(noise) == pytest.approx(0.0, abs=0.03e-3)
    faults = Timed('ripple_noisy@0').at(0.0)
    read = np.array([faults.through('reading', READING) for _ in range(2000)])
    ratio = read[:, 3] / read[:, 2] / (READING.flux_rate / READING.current_rate)
    assert np.std(ratio) == pytest.approx(0.2, rel=0.15)
    assert np.all(read[:, :2] == READING[:2])


def test_a_ripple_that_is_missing_or_of_wrong_scale():
    assert _begun('ripple_scale').at(BEGIN).through('reading', READING) == READING._replace(
        current_rate=325.0
    )
    for reading, present in zip(_changed('ripple_missing', 'reading', [READING] * 5), PRESENT, strict=True):
        assert (math.isnan(reading.current_rate), math.isnan(reading.flux_rate)) == (present, present)
        assert reading[:2] == READING[:2]


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
    assert _changed(name, 'current', (1.0, 1.0, 2.0, 0.0, 1.0)) == carried


@pytest.mark.parametrize(
    ('name', 'reported'),
    [
        ('coil_open', {}),
        ('over_current', {'over_current': True}),
        ('over_temperature', {'over_temperature': True}),
        ('under_voltage', {'under_voltage': True}),
        ('displacement_sensor', {'displacement_sensor': True}),
        ('temperature_250', {'coil_temperature_celsius': 250.0}),
        *((f'supply_{volts}', {'supply_voltage': volts}) for volts in (0, 5, 9, 16, 24)),
    ],
)
def test_what_the_status_says(name, reported):
    faulty = SOUND._replace(**reported)
    assert _changed(name, 'status', [SOUND] * 5) == [faulty if present else SOUND for present in PRESENT]


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
    faulty = _begun(name).at(BEGIN).through('plant', plant)
    assert getattr(faulty, part) == getattr(plant, part)._replace(**changed)


def test_a_hot_coil_is_reported_as_hot_as_it_is():
    plant, faults = Plant(), _begun('coil_hot').at(BEGIN)
    celsius = faults.through('plant', plant).electronics.coil_temperature
    assert 1.0 + plant.temperature.copper * (celsius - 20.0) == pytest.approx(1.4)
    assert faults.through('status', SOUND).coil_temperature_celsius == celsius


def test_a_plant_has_its_fault_and_is_sound_again_behind_it():
    faulty, sound = make_mount(faults=('gap_blocked@0.05:0.05',)), make_mount()
    for number in range(290):
        for mount in (faulty, sound):
            mount.measure()
            mount.advance(1.0)
        if number == 90:
            assert faulty.truth['normal_force'] == 0.0 < sound.truth['normal_force']
    assert faulty.truth['gap'] == pytest.approx(sound.truth['gap'], rel=1e-9)
    assert faulty.truth['normal_force'] == pytest.approx(sound.truth['normal_force'], rel=1e-9)
