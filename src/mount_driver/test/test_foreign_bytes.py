"""Whatever bytes come in as a frame or a datagram: a sound frame is used, all else costs itself alone."""

from far_end import CODEC, sample
from hypothesis import given
from hypothesis import strategies as st
from ros_testing import mutated

from mount_driver.bus import Frame, _message
from mount_driver.can_library import pack_message
from mount_driver.clock import CounterClock
from mount_driver.link import Link
from mount_driver.protocol import Status

SEEDS = st.integers(0, 1 << 62)
SOUND = bytes(CODEC.encode_measurement(sample(1), 1))
DATAGRAM = pack_message(Frame(CODEC.measurement.frame_id, SOUND))


def link():
    return Link(CODEC, CounterClock())


@given(SEEDS)
def test_a_mutated_frame_is_used_only_if_it_is_the_one_that_was_sent(seed):
    used = link()
    for number in range(1, 5):  # a receiver believes the third in order
        used.take(CODEC.encode_measurement(sample(number), number), number)
    sound = bytes(CODEC.encode_measurement(sample(5), 5))
    found = used.take(mutated(sound, seed), 5)
    assert found is None or found.sample == CODEC.measurement.decode(sound)[1]


@given(SEEDS)
def test_a_mutated_status_is_none_or_has_numbers_within_its_limits(seed):
    used = link()
    for number in range(1, 5):
        used.take_status(CODEC.encode_status(Status(13.5, 40.0), number))
    found = used.take_status(mutated(bytes(CODEC.encode_status(Status(12.5, 41.0), 5)), seed))
    assert found in (None, Status(12.5, 41.0))


@given(SEEDS)
def test_a_mutated_datagram_is_a_frame_of_bytes_or_refused(seed):
    datagram = mutated(DATAGRAM, seed)
    try:
        message = _message(datagram)
    except Exception:  # whatever: it is counted where frames are received
        return
    assert isinstance(message.arbitration_id, int)
    assert len(message.data) <= len(datagram)
    link().take(message.data, 0)
