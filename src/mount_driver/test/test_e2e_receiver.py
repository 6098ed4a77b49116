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
    return E2EReceiver(CODEC.setpoint)


def outcomes(receiver, counters):
    """Return what becomes of frames with these counters; only those in order are handed on."""
    seen = []
    for alive in counters:
        message = receiver.receive(frame(alive))
        assert (message is not None) == (receiver.outcome in USED)
        seen.append(receiver.outcome)
    return seen


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
    receiver = E2EReceiver(CODEC.setpoint)
    last = 255
    for alive in counters:
        if receiver.receive(frame(alive)) is not None:
            assert 1 <= (alive - last) % 256 <= CODEC.setpoint.max_delta_counter == 5
        last = alive


def test_what_is_damaged_or_not_allowed_is_not_used_and_its_counter_followed_only_where_it_is_known(receiver):
    damaged, beyond = frame(1), [0, 2, 30_001, 0, 0]
    damaged[2] ^= 0x40
    for data, outcome in (
        (frame(0), OK),
        (damaged, Outcome.CORRUPT),
        (bytes(7), Outcome.CORRUPT),
        (CODEC.setpoint.pack(beyond), Outcome.CORRUPT),
        (frame(3), OK),
    ):
        assert (receiver.receive(data) is not None) == (outcome is OK)
        assert receiver.outcome == outcome
    assert (receiver.lost, receiver.failed) == (1, 3)
