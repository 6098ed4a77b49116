"""The link counts what comes and lets only sound setpoints leave."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_driver.clock import ElectronicsClock
from mount_driver.link import Link, Refusal
from mount_driver.protocol import Measurement, MountCodec, Setpoint, Status

CODEC = MountCodec()
MS = 1_000_000
SAMPLE = Measurement(0, 0, 0.001, 0.5, 10.0, 20.0)


@pytest.fixture
def link():
    return new_link()


def new_link():
    return Link(CODEC, ElectronicsClock(0))


def frame(index, alive, **changes):
    sample = SAMPLE._replace(sample_counter=index % 65536, microseconds=index * 1000 % 2**32)
    return CODEC.encode_measurement(sample._replace(**changes), alive & 0xFF)


def feed(link, indices, first_alive=0):
    """Let samples arrive and be stamped: sample k at k ms, in one frame after the other."""
    return [
        link.take(frame(index, alive), index * MS) is not None
        for alive, index in enumerate(indices, first_alive)
    ]


@pytest.mark.parametrize('missing', [1, 3, 500])
def test_missing_samples_are_counted_by_their_number(link, missing):
    feed(link, [10, 11, 12 + missing])
    assert link.counts.lost == missing


def test_the_same_sample_again_with_other_values_is_a_contradiction(link):
    feed(link, [10, 11])
    link.take(frame(11, alive=2, setpoint_timeout=True), 12 * MS)  # which may come true meanwhile
    assert link.contradictions == 0
    link.take(frame(11, alive=3, displacement=0.002), 12 * MS)
    assert (link.contradictions, link.counts.resent) == (1, 2)


def test_a_late_sample_is_not_handed_on(link):
    assert feed(link, [10, 12, 11, 13]) == [True, True, False, True]
    assert link.counts.late == 1


@pytest.mark.parametrize(
    ('before', 'after'),
    [
        (2**31 // 1000 + 30_000, 5),  # after 36 min: half the counter's range and more
        (65_000, 65_400),  # of other numbers, soon after
        (1_000, 371_345),  # a pause of 370 s
    ],
)
def test_a_restart_or_a_pause_is_counted_once_and_not_as_lost_samples(link, before, after):
    feed(link, range(before, before + 10))
    counter = (after + 40_000) % 65536 if after == 65_400 else after
    for alive in range(10, 20):
        number = after + alive
        link.take(frame(number, alive, sample_counter=(counter + alive) % 65536), number * MS)
    assert link.counts.lost == 0
    assert link.clock.restarts + link.clock.gaps == (after != 65_400)


def test_a_status_is_kept_and_a_corrupt_one_is_not(link):
    link.take_status(CODEC.encode_status(Status(13.5, 40.0, e2e_error=True), 0))
    damaged = CODEC.encode_status(Status(1.5, 99.0), 1)
    damaged[3] ^= 1
    link.take_status(damaged)
    assert link.status == Status(13.5, 40.0, e2e_error=True)
    assert (link.counts.corrupt, link.counts.setpoint_errors) == (1, 1)


@pytest.mark.parametrize(
    ('stamp', 'current', 'reason'),
    [
        (99 * MS, math.nan, Refusal.NOT_A_NUMBER),
        (99 * MS, -1e-9, Refusal.NEGATIVE),
        (99 * MS, -math.inf, Refusal.NEGATIVE),
        (99 * MS + 1, 1.0, Refusal.UNKNOWN_SAMPLE),
        (100 * MS, 1.0, Refusal.UNKNOWN_SAMPLE),
        (20 * MS, 1.0, Refusal.UNKNOWN_SAMPLE),
        (78 * MS, 1.0, Refusal.STALE),
        (80 * MS, 1.0, Refusal.SUPERSEDED),
    ],
)
def test_a_doubtful_setpoint_is_refused_counted_and_the_reason_kept(link, stamp, current, reason):
    feed(link, range(65_500, 65_600))
    stamp += 65_500 * MS
    assert link.answer(65_581 * MS, 2.0, now=65_599 * MS) == Setpoint(2.0, 45, True)
    assert link.answer(stamp, current, now=65_599 * MS) is None
    assert link.last_refusal is reason
    assert (link.counts.refused, link.counts.setpoints) == (1, 1)


@pytest.mark.parametrize('current', [3.001, 100.0, math.inf])
def test_more_than_3_ampere_is_limited_and_counted(link, current):
    feed(link, [0])
    assert link.answer(0, current, now=0).current == 3.0
    assert link.counts.limited == 1


def test_off_is_repeated_once_per_timeout_and_counted_once(link):
    feed(link, [0])
    link.answer(0, 1.0, now=0)
    due = []
    for now in range(0, 100 * MS, MS):
        if link.off_is_due(now):
            link.off()
            due.append(now // MS)
    assert due == [21, 42, 63, 84]
    assert link.counts.setpoint_timeouts == 1


def test_the_last_setpoint_is_given_again_only_for_the_sample_that_it_answered(link):
    feed(link, [6, 7])
    assert link.answer_again(7, now=7 * MS) is None
    link.answer(7 * MS, 1.5, now=7 * MS)
    assert link.answer_again(7, now=27 * MS) == Setpoint(1.5, 7, True)
    assert link.answer_again(7, now=27 * MS + 1) is None
    assert link.answer_again(8, now=7 * MS) is None
    link.off()
    assert link.answer_again(7, now=7 * MS) is None


# The hold: whoever repeats himself, comes late or invents stamps


def test_a_second_answer_to_a_sample_may_only_lower_and_does_not_prolong(link):
    feed(link, [0])
    assert link.answer(0, 1.5, now=0).current == 1.5
    for current in (1.5, 1.6, 3.0, math.inf):
        assert link.answer(0, current, now=1 * MS) is None
    assert link.answer(0, 1.0, now=15 * MS).current == 1.0
    assert link.answer(0, 1.2, now=16 * MS) is None
    assert [link.answer(0, 0.0, now=17 * MS).current for _ in range(2)] == [0.0, 0.0]
    assert link.answer(0, 0.1, now=18 * MS) is None
    assert not link.off_is_due(20 * MS)
    assert link.off_is_due(20 * MS + 1)


def _answer_twice(link, index, first, second):
    feed(link, [index], first_alive=index)
    for current in (first, second):
        link.answer(index * MS, current, now=index * MS)


@pytest.mark.parametrize(
    ('first', 'second'), [(1.0, 3.0), (3.0, 1.0), (3.0, 0.0), (0.0, 3.0), (1.0, math.nan)]
)
def test_samples_that_are_answered_twice_and_differently_tell_of_a_second_sender(link, first, second):
    for index in range(3):
        assert link.double_answer == ''
        _answer_twice(link, index, first, second)
    assert link.double_answer == (
        f'3 samples within 1 s were answered twice, the last with {first:.3f} A and {second:.3f} A (limit: '
        'one answer each): end one of the two nodes that publish current_setpoint'
    )


def test_equal_answers_and_a_node_that_ends_now_and_then_are_no_second_sender(link):
    for index in range(9):
        _answer_twice(link, 600 * index, 1.0, 0.0)
        _answer_twice(link, 600 * index + 1, 1.0, 1.0)
    assert link.double_answer == ''


events = st.lists(
    st.one_of(
        st.tuples(st.just('wait'), st.integers(0, 30 * MS)),
        st.tuples(st.just('sample')),
        st.tuples(st.just('answer'), st.integers(-3, 30), st.floats(0.0, 3.0) | st.just(math.nan)),  # ago
        st.tuples(st.just('again')),
    ),
    max_size=80,
)


@settings(max_examples=300, deadline=None)
@given(events)
def test_no_current_ever_stands_on_a_sample_older_than_20_ms_nor_rises_without_a_new_one(happenings):
    link = new_link()
    now, index, arrivals, stamps = 0, 0, {}, {}
    on_bus, answered = Setpoint(0.0, 0, False), 0
    for kind, *details in happenings:
        sent = None
        if kind == 'wait':
            now += details[0]
        elif kind == 'sample':
            now += MS
            index += 1
            stamped = link.take(frame(index, index - 1), now)
            assert stamped is not None
            arrivals[index], stamps[index] = now, stamped.stamp
        elif kind == 'answer':
            sent = link.answer(stamps.get(index - details[0], -1), details[1], now)
        else:
            sent = link.answer_again(index, now)
        if sent is not None:
            assert now - arrivals[sent.answered_counter] <= 20 * MS
            assert sent.answered_counter > answered or (
                sent.answered_counter == answered and sent.current <= on_bus.current
            )
            on_bus, answered = sent, sent.answered_counter
        if link.off_is_due(now):
            on_bus = link.off()
        assert not on_bus.enable or now - arrivals[on_bus.answered_counter] <= 20 * MS
