"""Of each message one sender is accepted; a second one is named and the coil is off for good."""

import itertools
import random

import pytest
from car import GOOD, MS
from far_end import CODEC, sample

from mount_driver.bus import Frame, open_bus
from mount_driver.protocol import AliveCounter, Setpoint, Status
from mount_driver.watches.message_watches import SenderWatch

SECOND = {'limit 3', 'second sender', 'take every node but the electronics'}


@pytest.fixture
def other(car):
    """Return the second participant's bus."""
    bus = open_bus('virtual', car.channel)
    yield bus
    bus.shutdown()


class SecondElectronics:
    """Sends samples with counters of its own, begun `ahead` frames before ours."""

    def __init__(self, bus, ahead, **changes):
        self._bus, self._ahead, self._changes = bus, ahead, changes

    def send(self, index):
        k = index + self._ahead
        data = CODEC.encode_measurement(sample(k, **self._changes), (k - 1) & 0xFF)
        self._bus.send(Frame(CODEC.measurement.frame_id, data))


def both(car, second, before):
    """Return electronics and second electronics that send each ms, the second one first or last."""

    def send(index):
        if before:
            second.send(index)
        car.send_sample(index)
        if not before:
            second.send(index)

    return send


def named(car, *words):
    fault = car.exchange.link.fault
    assert all(word in fault for word in words), fault
    assert not car.exchange.link.needs_initialisation
    return True


@pytest.mark.parametrize('before', [True, False])
@pytest.mark.parametrize('ahead', [-50, 40, 5000, 30_000])
def test_a_second_sender_of_samples_with_its_own_counters(car, other, ahead, before):
    second = SecondElectronics(other, ahead, displacement=0.005)
    car.drive(500, car.answer, electronics=both(car, second, before))
    assert car.off_since() <= GOOD * MS + 5 * MS
    assert named(car, 'MountMeasurement', *SECOND)


@pytest.mark.parametrize('before', [True, False])
def test_a_second_sender_that_copies_the_counters(car, other, before):
    second = SecondElectronics(other, 0, displacement=0.005)
    car.drive(500, car.answer, electronics=both(car, second, before))
    assert car.off_since() <= GOOD * MS + 4 * MS
    assert named(car, 'MountMeasurement', *SECOND)


def test_a_second_sender_that_runs_ahead_with_counters_that_fit(car, other):
    """Its frames are believed, as far as they go: five samples ahead, each time again."""
    second = SecondElectronics(other, 4, displacement=0.005)

    def electronics(index):
        if index % 5 == 0:
            second.send(index)
        car.send_sample(index)

    car.drive(500, car.answer, electronics=electronics)
    assert car.off_since() <= GOOD * MS + 50 * MS
    assert named(car, 'MountMeasurement', *SECOND)


def test_old_frames_sent_again_between_the_new(car, other):
    recorded = [
        Frame(
            CODEC.measurement.frame_id, CODEC.encode_measurement(sample(k, coil_current=3.0), (k - 1) & 0xFF)
        )
        for k in range(1, GOOD)
    ]

    def electronics(index):
        car.send_sample(index)
        other.send(recorded[index % len(recorded)])

    car.drive(200, car.answer, electronics=electronics)
    assert car.off_since() <= GOOD * MS + 5 * MS
    assert named(car, 'MountMeasurement', 'old frames are sent again')


@pytest.mark.parametrize('ahead', [0, 7])
def test_a_second_sender_of_statuses(car, other, ahead):
    alive = itertools.count(1 + ahead)

    def electronics(index):
        if index % 100 == 50:
            status = CODEC.encode_status(Status(13.0, 30.0), next(alive) & 0xFF)
            other.send(Frame(CODEC.status.frame_id, status))
        car.send_sample(index)

    car.drive(1000, car.answer, electronics=electronics)
    assert car.off_since() <= GOOD * MS + 500 * MS
    assert named(car, 'MountStatus', *SECOND)


@pytest.mark.parametrize('enable', [True, False])
def test_one_setpoint_of_another_node_is_enough(car, other, enable):
    frame = CODEC.encode_setpoint(Setpoint(1.5, GOOD, enable), 77)
    other.send(Frame(CODEC.setpoint.frame_id, frame))
    car.drive(500, car.answer)
    assert car.off_since() <= GOOD * MS + MS
    assert named(car, 'another node sends MountSetpoint (1.500 A; 1 frame, limit 0)', 'take it off the bus')


def test_each_setpoint_of_another_node_has_0_ampere_behind_it(car, other):
    """So its frames never follow one another, and electronics that know of no second sender believe none."""
    alive = AliveCounter()

    def electronics(index):
        car.send_sample(index)
        data = CODEC.encode_setpoint(Setpoint(3.0, index & 0xFFFF, True), alive.next())
        other.send(Frame(CODEC.setpoint.frame_id, data))

    car.drive(50, car.answer, electronics=electronics)
    heard = [(setpoint.current, setpoint.enable) for _, setpoint in car.sent[GOOD:]]
    begin = heard.index((0.0, False))
    foreign = [k for k, entry in enumerate(heard) if entry == (3.0, True) and k > begin]
    assert len(foreign) > 40
    assert all(heard[k + 1] == (0.0, False) for k in foreign)


@pytest.mark.parametrize('lost', [0.05, 0.5, 0.9])
def test_lost_frames_are_no_second_sender(car, lost):
    chance = random.Random(7)

    def electronics(index):
        data = CODEC.encode_measurement(sample(index, coil_current=car.on_bus().current), (index - 1) & 0xFF)
        if chance.random() >= lost:
            car.far.bus.send(Frame(CODEC.measurement.frame_id, data))

    car.drive(2000, car.answer, electronics=electronics)
    link = car.exchange.link
    assert (link.samples.strangers, link.contradictions) == (0, 0)


def test_frames_of_a_second_sender_far_apart_are_counted_alone():
    watch = SenderWatch('MountStatus', 'look')
    assert [watch.judge(k, k * 6000 * MS) for k in range(10)] == [''] * 10
    assert 'MountStatus within 10 s (limit 3)' in watch.judge(12, 9 * 6000 * MS)
