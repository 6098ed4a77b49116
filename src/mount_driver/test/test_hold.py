"""How long a current stands on the bus: time is told by the test, so no machine is too slow for it."""

import re
import threading

import pytest
from car import GOOD, MS, Car
from far_end import CODEC, sample
from ros_testing import wait_until

from mount_driver import exchange as exchange_module
from mount_driver.bus import Frame
from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.link import Refusal
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import AliveCounter, Setpoint, Status

HOLD = 20 * MS


@pytest.fixture
def car():
    made = Car()
    made.drive(GOOD, made.answer)
    assert made.on_bus() == Setpoint(3.0, GOOD, True)
    yield made
    made.exchange.stop()
    made.far.close()


def nothing(*_):
    pass


def test_a_node_that_publishes_the_same_message_for_ever_holds_its_current_for_20_ms(car):
    frozen = car.stamps[-1]
    car.drive(3000, lambda: car.exchange.send_setpoint(frozen, 3.0))
    assert car.went_off() == HOLD + 1


def test_it_does_so_too_when_the_electronics_fall_silent(car):
    frozen = car.stamps[-1]
    car.drive(3000, lambda: car.exchange.send_setpoint(frozen, 3.0), electronics=nothing)
    assert car.went_off() == HOLD + 1


def test_a_frozen_measurement_frame_feeds_nothing(car):
    frozen = Frame(
        CODEC.measurement.frame_id, CODEC.encode_measurement(sample(GOOD), (GOOD - 1) & 0xFF)
    )  # the last one, byte by byte
    car.drive(3000, car.answer, electronics=lambda _: car.far.bus.send(frozen))
    assert car.stamps[GOOD:] == []
    assert car.went_off() == HOLD + 1
    assert car.exchange.last_received == GOOD * MS


def test_a_frozen_sample_in_frames_that_live_feeds_nothing(car):
    car.drive(15, car.answer, electronics=lambda _: car.far.send(sample(GOOD, coil_current=3.0)))
    again, car.sent = [setpoint for _, setpoint in car.sent[GOOD:]], car.sent[:GOOD]
    assert set(again) == {Setpoint(3.0, GOOD, True)}  # the answer once more, for electronics that missed it
    car.drive(3000, car.answer, electronics=lambda _: car.far.send(sample(GOOD, coil_current=3.0)))
    later = [(time, setpoint) for time, setpoint in car.sent if setpoint.enable]
    assert later[-1][0] <= GOOD * MS + HOLD
    assert not car.on_bus().enable


@pytest.mark.parametrize('late', [21, 30, 60])
def test_answers_that_come_too_late_move_nothing(car, late):
    car.drive(1000, lambda: car.exchange.send_setpoint(car.stamps[-1 - late], 3.0))
    assert car.went_off() == HOLD + 1


def test_answers_19_ms_late_are_within_the_limit(car):
    car.drive(1000, lambda: car.exchange.send_setpoint(car.stamps[-1 - 19], 3.0))
    assert car.on_bus().current == 3.0


def test_a_first_answer_60_s_behind_its_sample_moves_nothing(car):
    car.drive(60_000, nothing, electronics=nothing)
    car.exchange.send_setpoint(car.stamps[-1], 3.0)
    car.look()
    assert car.went_off() == HOLD + 1
    assert car.exchange.link.last_refusal is Refusal.STALE


def test_made_up_stamps_of_the_future_move_nothing(car):
    car.drive(1000, lambda: car.exchange.send_setpoint(car.stamps[-1] + 50 * MS, 3.0))
    assert car.went_off() == HOLD + 1


def test_a_node_that_comes_to_itself_is_obeyed_again(car):
    car.drive(100, nothing)
    assert not car.on_bus().enable
    car.drive(1, car.answer)
    assert car.on_bus() == Setpoint(3.0, GOOD + 101, True)


def stuck(car):
    """Electronics whose coil carries 3 A, whatever is wanted."""
    return lambda index: car.far.send(sample(index, coil_current=3.0))


def test_a_coil_that_does_not_follow_is_switched_off_in_time_and_stays_so(car):
    """The setpoint falls from 3 A to 1 A: 20 ms in which a late one may be followed, 20 ms of deviation."""
    car.drive(3000, lambda: car.exchange.send_setpoint(car.stamps[-1], 1.0), electronics=stuck(car))
    last = [time for time, setpoint in car.sent if setpoint.enable][-1]
    assert GOOD + 20 <= last // MS <= GOOD + 45
    assert {setpoint for time, setpoint in car.sent if time > last} == {
        Setpoint(0.0, car.on_bus().answered_counter, False)
    }
    assert car.exchange.link.last_refusal is Refusal.SWITCHED_OFF
    told = r'coil current \(3\.000 A\) must lie within .* it has not for 20 ms in all: check supply'
    assert re.match(told, car.exchange.link.fault)


def test_a_coil_that_comes_to_itself_stays_off(car):
    car.drive(100, lambda: car.exchange.send_setpoint(car.stamps[-1], 1.0), electronics=stuck(car))
    fault = car.exchange.link.fault
    car.drive(3000, car.answer)
    assert car.on_bus() == Setpoint(0.0, car.on_bus().answered_counter, False)
    assert car.exchange.link.fault == fault != ''


def test_an_answer_sent_again_does_not_outlast_the_fault(car):
    car.drive(100, lambda: car.exchange.send_setpoint(car.stamps[-1], 1.0), electronics=stuck(car))
    before = len(car.sent)
    car.drive(15, nothing, electronics=lambda _: car.far.send(sample(GOOD + 100, coil_current=3.0)))
    assert not any(setpoint.enable for _, setpoint in car.sent[before:])


@pytest.mark.parametrize('bit', ['over_current', 'over_temperature', 'under_voltage'])
def test_a_fault_that_the_electronics_report_switches_off_at_once_and_for_good(car, bit):
    car.far.send_status(Status(14.0, 20.0, **{bit: True}))
    car.drive(1000, car.answer)
    assert car.went_off() == MS
    assert bit in car.exchange.link.fault


@pytest.mark.parametrize('status', [Status(5.0, 20.0), Status(24.0, 20.0), Status(14.0, 250.0)])
def test_a_value_beyond_its_limit_does_so_too(car, status):
    car.far.send_status(status)
    car.drive(1000, car.answer)
    assert car.went_off() == MS


def test_a_displacement_sensor_at_fault_gives_0_ampere_until_it_is_well(car):
    car.far.send_status(Status(14.0, 20.0, displacement_sensor=True))
    car.drive(99, car.answer)
    assert {setpoint.current for _, setpoint in car.sent[GOOD + 1 :]} == {0.0}
    car.drive(2, car.answer)  # with a sound status
    assert car.on_bus().current == 3.0


def test_without_a_status_for_1_s_there_are_0_ampere(car):
    def measuring_alone(index):
        car.far.send(sample(index, coil_current=car.on_bus().current))

    car.drive(1000, car.answer, electronics=measuring_alone)
    assert car.on_bus().current == 3.0
    car.drive(3, car.answer, electronics=measuring_alone)
    assert car.on_bus().current == 0.0
    assert 'no status' in car.exchange.guard.limits.held


class SilentBus:
    """Has one sample to give, 5 ms after the start, and nothing else."""

    def __init__(self, clock):
        self._clock = clock
        self._frame = Frame(
            CODEC.measurement.frame_id, CODEC.encode_measurement(sample(0), AliveCounter().next())
        )
        self.sent = []

    def recv(self, timeout):
        frame, self._frame = self._frame, None
        if frame is not None:
            self._clock.now += 5 * MS
        return frame

    def send(self, message):
        self.sent.append((self._clock.now, CODEC.decode_setpoint(message.data)[1]))

    def shutdown(self):
        pass


class Steady:
    """A steady clock that stands until somebody moves it."""

    now = 10**9

    def __call__(self):
        return self.now


class Sleep(threading.Event):
    """Waits on the steady clock of a test: until the sample is answered nothing moves it on."""

    def __init__(self, steady, answered):
        super().__init__()
        self._steady, self._answered = steady, answered

    def wait(self, timeout=None):
        end = self._steady.now + round(1e9 * timeout)
        self._answered.wait()
        self._steady.now = max(self._steady.now, end) + 1000  # the processor takes its time, too
        return self.is_set()


def test_a_controller_that_hangs_holds_up_neither_the_watch_nor_its_0_ampere(monkeypatch):
    steady, answered, hanging = Steady(), threading.Event(), threading.Event()
    bus = SilentBus(steady)
    monkeypatch.setattr(exchange_module, 'open_bus', lambda *_, **__: bus)

    def answer(stamped):
        steady.now += 8 * MS
        exchange.send_setpoint(stamped.stamp, 3.0)
        answered.set()
        hanging.wait()

    exchange = Exchange(DriverParameters(), CODEC, ElectronicsClock(0), answer, steady=steady)
    exchange._ending = Sleep(steady, answered)
    try:
        exchange.start()
        wait_until(lambda: len(bus.sent) >= 2, '0 A')
    finally:
        hanging.set()
        exchange.stop()
    (answered_at, first), (off_at, off) = bus.sent[:2]
    assert (answered_at, first) == (10**9 + 13 * MS, Setpoint(3.0, 0, True))
    assert off == Setpoint(0.0, 0, False)
    assert HOLD < off_at - 10**9 - 5 * MS <= HOLD + MS // 100


def test_a_sample_is_judged_before_an_answer_that_is_given_at_once(car):
    car.exchange._on_sample = lambda stamped: car.exchange.send_setpoint(stamped.stamp, 3.0)
    car.sent.clear()
    car.drive(1, lambda: None, lambda index: car.far.send(sample(5)))  # the electronics have begun anew
    assert 'begun anew' in car.exchange.link.fault
    assert [setpoint.enable for _, setpoint in car.sent] == [False]


def test_late_setpoints_are_counted_whichever_watch_they_miss(car):
    late = car.exchange.link.counts
    assert late.late_setpoints == 0
    car.drive(30, nothing)
    assert late.late_setpoints == 1  # the watch of the driver
    car.exchange.send_setpoint(car.stamps[-22], 3.0)
    assert late.late_setpoints == 2  # an answer refused for its age
    car.drive(1, car.answer)

    def unreached(index):
        car.far.send(sample(index)._replace(setpoint_timeout=True))

    car.drive(5, car.answer, electronics=unreached)
    assert late.late_setpoints == 3  # the watch of the electronics
