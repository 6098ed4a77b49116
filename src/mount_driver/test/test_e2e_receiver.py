"""Every frame is judged: next, repeated, some lost, late, damaged."""

import pytest

from mount_driver.codec import Measurement, MountCodec, Setpoint
from mount_driver.e2e_receiver import AliveCounter, E2EReceiver, Outcome

CODEC = MountCodec()


def frame(alive):
    return CODEC.encode_setpoint(Setpoint(1.0, alive), alive & 0xFF)


@pytest.fixture
def receiver():
    return E2EReceiver(CODEC.decode_setpoint)


def outcomes(receiver, counters):
    seen = []
    for alive in counters:
        assert receiver.receive(frame(alive)) is not None
        seen.append(receiver.outcome)
    return seen


def test_frames_in_order_are_ok_across_the_wrap(receiver):
    assert set(outcomes(receiver, range(200, 600))) == {Outcome.OK}
    assert receiver.lost == 0
    assert receiver.counts[Outcome.OK] == 400


def test_a_frame_twice_is_repeated(receiver):
    assert outcomes(receiver, [5, 5, 6]) == [Outcome.OK, Outcome.REPEATED, Outcome.OK]


@pytest.mark.parametrize('missing', [1, 2, 50, 126])
def test_missing_frames_are_counted(receiver, missing):
    assert outcomes(receiver, [250, 251 + missing]) == [Outcome.OK, Outcome.LOST]
    assert receiver.lost == missing


def test_a_late_frame_does_not_set_the_count_back(receiver):
    assert outcomes(receiver, [10, 12, 11, 13]) == [Outcome.OK, Outcome.LOST, Outcome.LATE, Outcome.OK]
    assert receiver.lost == 1


def test_a_sender_that_begins_anew_is_followed(receiver):
    assert outcomes(receiver, [90, 0, 1, 2]) == [Outcome.OK, Outcome.LATE, Outcome.LATE, Outcome.OK]


def test_damage_is_never_handed_on(receiver):
    data = frame(0)
    data[4] ^= 1
    assert receiver.receive(data) is None
    assert receiver.outcome == Outcome.WRONG_CRC
    assert receiver.receive(bytes(7)) is None
    assert receiver.outcome == Outcome.WRONG_LENGTH
    assert receiver.corrupt == 2


def test_damage_does_not_disturb_the_order(receiver):
    receiver.receive(frame(0))
    damaged = frame(1)
    damaged[2] ^= 0x40
    receiver.receive(damaged)
    receiver.receive(frame(2))
    assert (receiver.outcome, receiver.lost) == (Outcome.LOST, 1)


def test_a_measurement_goes_through():
    receiver = E2EReceiver(CODEC.decode_measurement)
    sample = Measurement(3, 5, 0.001, 0.5, 1.0, 2.0)
    assert receiver.receive(CODEC.encode_measurement(sample, 0)) == sample


def test_the_alive_counter_wraps_after_255():
    counter = AliveCounter()
    assert [counter.next() for _ in range(258)][-3:] == [255, 0, 1]
