"""The electronics on a virtual bus, with a host that the test plays."""

import contextlib
import itertools
import math
import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from ros_testing import LIMIT
from simulated_mounts import make_mount

from mount_driver.can_library import can
from mount_driver.protocol import AliveCounter, MountCodec, Setpoint
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.electronics import Reading
from mount_sim.loop import CarLoop, ElectronicsLoop, NoAnswerError, until_ending
from mount_sim.quantisation import quantised_displacement

CODEC = MountCodec()
_channels = itertools.count()


def _bus(channel):
    return can.Bus(interface='virtual', channel=channel, protocol=can.CanProtocol.CAN_FD)


def _frame(data, identifier=CODEC.setpoint.frame_id):
    return can.Message(arbitration_id=identifier, data=data, is_fd=True, is_extended_id=False)


class Host:
    """Answers each measurement by a function; keeps what it received."""

    def __init__(self, channel):
        self.bus = _bus(channel)
        self.samples, self.statuses = [], []
        self.last = 255  # alive counter
        self._alive = AliveCounter()

    def send(self, setpoint, damage=0):
        self.last = self._alive.next()
        data = CODEC.encode_setpoint(setpoint, self.last)
        data[-1] ^= damage
        self.bus.send(_frame(data))

    def skip(self, count):
        for _ in range(count):
            self._alive.next()

    def restart(self):
        self._alive = AliveCounter()

    def receive(self):
        """Take one frame; return the sample if it was one."""
        frame = self.bus.recv(LIMIT)
        assert frame is not None
        if frame.arbitration_id == CODEC.status.frame_id:
            self.statuses.append(CODEC.status.decode(frame.data)[1])
            return None
        self.samples.append(CODEC.measurement.decode(frame.data)[1])
        return self.samples[-1]


@pytest.fixture
def ends():
    """Return (far end, host) on a bus of their own."""
    channel = f'test_loop_{next(_channels)}'
    end, host = CanEnd(_bus(channel)), Host(channel)
    yield end, host
    end.close()
    host.bus.shutdown()


def _loop(mount, end, published=None):
    publish = (published if published is not None else []).append
    return ElectronicsLoop(mount, end, publish)


def _car(loop):
    """Electronics of one mount alone."""
    return CarLoop({'': loop}, 0.0, 1000.0)


def _in_thread(target, *arguments):
    thread = threading.Thread(target=target, args=arguments)
    thread.start()
    return thread


def _answered(ends, mount, current=0.0, published=None, patience=LIMIT, count=300):
    """Run in lock-step while the host answers `count` samples with `current` (A); return the loop."""
    end, host = ends
    loop = _loop(mount, end, published)
    car = _car(loop)
    while not car.finished:
        if car.step_in_lockstep(patience):
            sample = _next_sample(host)
            if len(host.samples) <= count:
                host.send(Setpoint(current, sample.sample_counter))
    return loop


@contextlib.contextmanager
def _in_real_time(ends, mount):
    """Run in real time; behind the block the electronics have ended."""
    ending, loop = threading.Event(), _loop(mount, ends[0])
    running = _in_thread(_car(loop).run_in_real_time, ending)
    try:
        yield loop
    finally:
        ending.set()
        running.join()


def _switched_on(host, mount):
    """Answer with 1 A until it flows; return the last sample."""
    sample = _next_sample(host)
    while mount.truth['coil_current'] < 0.5:
        host.send(Setpoint(1.0, sample.sample_counter))
        sample = _next_sample(host)
    return sample


# The end of the bus


@pytest.mark.parametrize('displacement', [0.05, -0.05, 0.05001, -0.05001, 1e3, math.inf])
def test_readings_arrive_over_the_bus_as_in_core_whatever_they_are(ends, displacement):
    """What has no place in the message is not valid; it neither ends the electronics nor is cut to fit."""
    end, host = ends
    reading = Reading(displacement, 7.0, 1e6, 0.5)
    end.send_frame(end.measurement_frame(1, 1000, reading, enabled=True))
    sample = host.receive()
    np.testing.assert_array_equal(sample.displacement, quantised_displacement(displacement))
    assert math.isnan(sample.displacement) == (abs(displacement) > 0.05)
    assert math.isnan(sample.coil_current)
    assert math.isnan(sample.current_rate)
    assert math.isnan(sample.flux_rate)  # shares its validity with the slope of the current


def test_only_the_answer_to_the_asked_sample_ends_the_wait(ends):
    end, host = ends
    for counter in (6, 8, 7):
        host.send(Setpoint(0.1 * counter, counter))
    received = end.answer_to(7)
    assert received.setpoint == Setpoint(pytest.approx(0.7), 7, True)
    assert end.answer_to(7) is None


def test_a_frame_that_switches_off_answers_no_sample(ends):
    end, host = ends
    host.send(Setpoint(0.0, 7, enable=False))
    assert end.answer_to(7) is None
    host.send(Setpoint(0.0, 7, enable=False))
    assert not end.newest().setpoint.enable  # but it is taken over where nobody waits


def test_damaged_and_foreign_frames_are_no_setpoints(ends):
    end, host = ends
    host.send(Setpoint(0.5, 7), damage=0x10)
    host.bus.send(_frame(b'\0' * 8, identifier=0x123))
    assert end.answer_to(7) is None
    assert end.failed_setpoints == 1
    host.send(Setpoint(0.5, 7), damage=0x10)
    assert end.newest() is None


def test_a_repeated_or_late_frame_is_no_setpoint(ends):
    end, host = ends
    frames = [_frame(CODEC.encode_setpoint(Setpoint(0.1 * k, k), k)) for k in range(11)]
    for frame in frames:
        host.bus.send(frame)
    assert end.newest().setpoint.answered_counter == 10
    host.bus.send(frames[10])
    assert end.newest() is None  # repeated
    host.bus.send(frames[9])
    assert end.newest() is None  # 9 after 10
    assert end.failed_setpoints == 2


def test_the_time_of_arrival_is_that_of_the_bus_and_unknown_where_its_clock_is_another(ends):
    end, host = ends
    before = time.time()
    host.send(Setpoint(0.5, 7))
    assert before <= end.newest().arrival <= time.time()
    host.bus.preserve_timestamps = True  # those of the sender: 0 s
    host.send(Setpoint(0.5, 7))
    assert math.isnan(end.newest().arrival)


# Lock-step


def test_in_lock_step_each_sample_waits_for_its_answer(ends):
    host, mount, published = ends[1], make_mount(), []
    loop = _answered(ends, mount, published=published)
    assert mount.finished
    assert published == list(range(300))
    assert [sample.sample_counter for sample in host.samples] == list(range(300))
    assert [sample.microseconds for sample in host.samples] == [1000 * k for k in range(300)]
    assert all(sample.enabled for sample in host.samples)
    assert (loop.figures.samples, loop.figures.answered, loop.figures.overruns) == (300, 300, 0)
    assert loop.figures.latency.count == 300
    assert loop.figures.wall_time > 0.0
    assert len(host.statuses) == 3  # 10 Hz
    assert host.statuses[0].supply_voltage == pytest.approx(14.0)


def test_lock_step_over_the_bus_equals_plain_function_calls(ends):
    over_bus, truths = make_mount(), []
    _answered(ends, over_bus, 1.0, SimpleNamespace(append=lambda number: truths.append(over_bus.truth_bytes)))
    plain, answer = make_mount(), None
    for number in range(300):
        plain.measure()
        assert plain.truth_bytes == truths[number]
        plain.advance(answer)
        answer = 1.0


def test_an_answer_that_does_not_come_ends_the_run_and_names_the_sample(ends):
    mount = make_mount()
    with pytest.raises(NoAnswerError, match=r'sample 20 \(0\.020 s\) was not answered within 0\.5 s'):
        _answered(ends, mount, patience=0.5, count=20)
    assert mount.sample == 21


def test_the_first_sample_waits_for_whoever_answers_it(ends):
    loop = _loop(make_mount(), ends[0])
    assert [loop.step_in_lockstep(0.0) for _ in range(9)] == [True] + [False] * 8  # no patience at all


def test_a_mount_beyond_the_range_of_its_sensor_goes_on_and_is_told(ends):
    """The rack is told to move farther than the sensor reaches, as a rough road can."""
    host = ends[1]
    mount = make_mount(lambda values: np.multiply(values, 80.0, out=values))  # to 80 mm
    loop = _answered(ends, mount)
    assert loop.figures.samples == 300
    invalid = [sample.sample_counter for sample in host.samples if math.isnan(sample.displacement)]
    assert 0 < len(invalid) < 300
    assert loop.figures.beyond_range.samples == len(invalid)
    assert loop.figures.beyond_range.first == pytest.approx(invalid[0] * 1e-3)
    beyond = [any(begin <= k < begin + 100 for k in invalid) for begin in (0, 100)]
    assert [status.displacement_sensor for status in host.statuses] == [False, *beyond]


# Doubtful setpoints


def _statuses(host, loop, damage):
    """Ten statuses; `damage(number)` does what it wants to the bus before sample `number` is taken."""
    for number in range(902):
        damage(number)
        host.send(Setpoint(1.0, number - 1 & 0xFFFF))
        loop.send_sample()
        loop.go_on()
        while host.receive() is None:
            pass
    return [status.e2e_error for status in host.statuses]


@pytest.mark.parametrize(
    'doubt',
    [
        lambda host: host.send(Setpoint(1.0, 0), damage=0x10),
        lambda host: host.bus.send(_frame(CODEC.encode_setpoint(Setpoint(1.0, 0), host.last))),
        lambda host: host.bus.send(_frame(CODEC.encode_setpoint(Setpoint(1.0, 0), host.last - 1 & 0xFF))),
        lambda host: host.bus.send(_frame(b'too short')),
        lambda host: host.restart(),
    ],
    ids=['damaged', 'repeated', 'late', 'of wrong length', 'host restarted'],
)
def test_the_next_status_tells_of_a_doubtful_setpoint_frame_and_the_one_behind_it_no_more(ends, doubt):
    end, host = ends
    loop = _loop(make_mount(timeline__duration=1.0), end)
    told = _statuses(host, loop, lambda number: doubt(host) if number == 350 else None)
    assert told == [False] * 4 + [True] + [False] * 5


@pytest.mark.parametrize(
    ('late', 'samples'), [(0, 20), (1, 19), (5, 15), (19, 1), (20, 0), (200, 0), (-1, 0)]
)
def test_an_answer_holds_for_20_ms_from_when_it_was_due_and_not_at_all_behind_that(ends, late, samples):
    end, host = ends
    mount, setpoints = make_mount(timeline__duration=1.0), []
    loop = _loop(mount, end)
    for number in range(400):
        if number == 300:
            host.send(Setpoint(1.0, number - 1 - late))
        loop.send_sample()
        loop.go_on()
        setpoints.append(mount.truth['current_setpoint'])
    # The truth at a sample is that of the step before it.
    assert [number for number, current in enumerate(setpoints) if current > 0.0] == list(
        range(301, 301 + samples)
    )


# Faults and real time


def test_a_deaf_end_switches_off_on_its_own_and_says_so(ends):
    host, mount = ends[1], make_mount(faults=('deaf@0',))
    loop = _answered(ends, mount, 1.0)
    assert mount.truth['coil_current'] == 0.0
    assert [sample.enabled for sample in host.samples] == [True] * 20 + [False] * 280
    assert [sample.setpoint_timeout for sample in host.samples] == [False] * 20 + [True] * 280
    assert [status.setpoint_timeout for status in host.statuses[:3]] == [False, True, True]
    assert loop.figures.answered == 1  # the last one, after the run


def test_electronics_that_are_asked_to_end_in_real_time_go_on_until_the_coil_is_discharged(ends):
    mount = make_mount(timeline__duration=20.0)
    with _in_real_time(ends, mount):
        _switched_on(ends[1], mount)
    assert mount.truth['coil_current'] < 0.01  # A


def test_electronics_end_though_their_coil_keeps_its_current():
    ending = threading.Event()
    ending.set()
    begin = time.monotonic()
    for _ in until_ending(ending, lambda: False):
        time.sleep(1e-3)
    assert time.monotonic() - begin >= 0.1  # s; that it ends at all is what is asked


def _next_sample(host):
    while (sample := host.receive()) is None:
        pass
    return sample


def test_in_real_time_the_electronics_sample_by_their_clock_behind_the_end_of_the_run_too(ends):
    host, mount = ends[1], make_mount(timeline__duration=0.2)
    with _in_real_time(ends, mount) as loop:
        while len(host.samples) < 300:
            host.receive()
    assert mount.finished
    assert loop.figures.samples >= 300
    assert loop.figures.wall_time >= 1e-3 * (loop.figures.samples - 1) - 0.002
    assert [sample.enabled for sample in host.samples[:200]] == [True] * 20 + [False] * 180


# Whose turn the processors are


def test_the_wait_for_an_answer_ends_with_a_frame_or_its_limit():
    here, there = socket.socketpair()
    with here, there:
        end = CanEnd(SimpleNamespace(fileno=here.fileno))
        begin = time.monotonic()
        end.wait_for_frame(0.01)
        assert time.monotonic() - begin >= 0.01
        there.send(b'a frame')
        end.wait_for_frame(LIMIT)
        assert time.monotonic() - begin < LIMIT
