"""How long a current stands on the bus: time is told by the test, so no machine is too slow for it."""

import re

from car import GOOD, MS
from far_end import CODEC, sample

from mount_driver.bus import Frame
from mount_driver.link import Refusal
from mount_driver.protocol import Setpoint, Status

HOLD = 20 * MS


def nothing(*_):
    pass


def test_a_node_that_publishes_the_same_message_for_ever_holds_its_current_for_20_ms(car):
    frozen = car.stamps[-1]
    car.drive(3000, lambda: car.exchange.send_setpoint(frozen, 3.0))
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
    fault = car.exchange.link.fault
    assert re.match(told, fault)
    car.drive(3000, car.answer)  # the coil has come to itself
    assert not car.on_bus().enable
    assert car.exchange.link.fault == fault


def test_an_answer_sent_again_does_not_outlast_the_fault(car):
    car.drive(100, lambda: car.exchange.send_setpoint(car.stamps[-1], 1.0), electronics=stuck(car))
    before = len(car.sent)
    car.drive(15, nothing, electronics=lambda _: car.far.send(sample(GOOD + 100, coil_current=3.0)))
    assert not any(setpoint.enable for _, setpoint in car.sent[before:])


def test_a_fault_that_the_electronics_report_switches_off_at_once_and_for_good(car):
    car.far.send_status(Status(14.0, 20.0, over_current=True))
    car.drive(1000, car.answer)
    assert car.went_off() == MS
    assert 'over_current' in car.exchange.link.fault


def test_without_a_status_for_1_s_there_are_0_ampere(car):
    def measuring_alone(index):
        car.far.send(sample(index, coil_current=car.on_bus().current))

    car.drive(1000, car.answer, electronics=measuring_alone)
    assert car.on_bus().current == 3.0
    car.drive(3, car.answer, electronics=measuring_alone)
    assert car.on_bus().current == 0.0
    assert 'no status' in car.exchange.guard.limits.held


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
