"""Every frame is judged: next, repeated, some lost, of wrong sequence, damaged; what is in order is used."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_driver.protocol import E2EReceiver, MountCodec, Outcome, Setpoint

CODEC = MountCodec()
OK, REPEATED, SYNCHRONISING = Outcome.OK, Outcome.REPEATED, Outcome.SYNCHRONISING
WRONG = Outcome.WRONG_SEQUENCE
USED = {Outcome.OK, Outcome.LOST}


def frame(alive):
    return CODEC.encode_setpoint(Setpoint(1.0, alive), alive & 0xFF)


@pytest.fixture
def receiver():
    return E2EReceiver(CODEC.setpoint, CODEC.setpoint_of)


def outcomes(receiver, counters):
    """Return what becomes of frames with these counters; only those in order are handed on."""
    seen = []
    for alive in counters:
        message = receiver.receive(frame(alive))
        assert (message is not None) == (receiver.outcome in USED)
        seen.append(receiver.outcome)
    return seen


def test_frames_in_order_are_ok_across_the_wrap(receiver):
    assert set(outcomes(receiver, range(600))) == {Outcome.OK}
    assert receiver.lost == 0
    assert receiver.counts[Outcome.OK] == 600


def test_a_frame_twice_is_used_once(receiver):
    assert outcomes(receiver, [0, 0, 1, 1, 1, 2]) == [OK, REPEATED, OK, REPEATED, REPEATED, OK]
    assert receiver.failed == 3


@pytest.mark.parametrize('missing', [1, 2, 4])
def test_a_few_missing_frames_are_counted(receiver, missing):
    outcomes(receiver, range(251))
    assert outcomes(receiver, [251 + missing]) == [Outcome.LOST]
    assert receiver.lost == missing
    assert receiver.failed == 0


@pytest.mark.parametrize('missing', [5, 126, 127, 128, 254])
def test_after_many_missing_frames_the_counter_says_nothing_until_three_follow_in_order(receiver, missing):
    outcomes(receiver, range(251))
    next_one = 251 + missing
    assert outcomes(receiver, range(next_one, next_one + 5)) == [WRONG, SYNCHRONISING, SYNCHRONISING, OK, OK]


def test_a_counter_that_goes_back_is_refused_until_three_follow_in_order(receiver):
    outcomes(receiver, range(11))
    assert outcomes(receiver, [9, 11, 12, 13]) == [WRONG, SYNCHRONISING, SYNCHRONISING, OK]


def test_old_frames_between_the_new_keep_both_from_being_used(receiver):
    outcomes(receiver, range(100))
    mixed = [counter for k in range(100) for counter in (50 + k, 100 + k)]
    assert not USED & set(outcomes(receiver, mixed))


def test_a_sender_that_begins_anew_is_followed_from_its_fourth_frame_and_noticed_once(receiver):
    outcomes(receiver, range(91))
    assert outcomes(receiver, range(6)) == [WRONG, SYNCHRONISING, SYNCHRONISING, OK, OK, OK]
    assert receiver.failed == 1


def test_a_receiver_that_begins_amid_the_frames_believes_the_fourth_and_complains_of_none(receiver):
    assert outcomes(receiver, range(255, 260)) == [SYNCHRONISING, SYNCHRONISING, SYNCHRONISING, OK, OK]
    assert receiver.failed == 0


def test_a_repeated_frame_does_not_help_to_be_believed(receiver):
    assert outcomes(receiver, [70, 70, 70, 71, 71, 72, 73]) == [
        SYNCHRONISING,
        REPEATED,
        REPEATED,
        SYNCHRONISING,
        REPEATED,
        SYNCHRONISING,
        OK,
    ]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.integers(0, 255), max_size=60))
def test_whatever_comes_only_a_step_of_one_to_five_is_used(counters):
    receiver = E2EReceiver(CODEC.setpoint, CODEC.setpoint_of)
    last = 255
    for alive in counters:
        if receiver.receive(frame(alive)) is not None:
            assert 1 <= (alive - last) % 256 <= CODEC.setpoint.max_delta_counter == 5
        last = alive


def test_damage_is_never_handed_on(receiver):
    data = frame(0)
    data[4] ^= 1
    assert receiver.receive(data) is None
    assert receiver.outcome == Outcome.WRONG_CRC
    assert receiver.receive(bytes(7)) is None
    assert receiver.outcome == Outcome.WRONG_LENGTH
    assert receiver.failed == 2


def test_damage_does_not_disturb_the_order(receiver):
    receiver.receive(frame(0))
    damaged = frame(1)
    damaged[2] ^= 0x40
    receiver.receive(damaged)
    receiver.receive(frame(2))
    assert (receiver.outcome, receiver.lost) == (Outcome.LOST, 1)


def test_a_content_that_is_not_allowed_is_not_used_but_its_counter_is_followed():
    forbidding = E2EReceiver(CODEC.setpoint, lambda raw: None if raw[1] == 1 else raw)
    assert [forbidding.receive(frame(alive)) is not None for alive in range(3)] == [True, False, True]
    assert forbidding.counts[Outcome.OUT_OF_RANGE] == forbidding.failed == 1
    assert forbidding.outcome == Outcome.OK
