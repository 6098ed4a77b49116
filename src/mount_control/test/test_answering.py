"""The way of a sample to its answer, one by one and many at once."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_control.answering import OFF, Answer, Answering
from mount_control.controller import ControlLaw, Controller
from mount_control.sample_watch import Judgement

MS, START = 1_000_000, 5_000_000_000  # ns
PERIODS = [0.999, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.001, 1.49]  # ms
ODD = [-3.0, -0.5, 0.0, 0.2, 1.5, 2.0, 5.0, 19.9, 21.0, 30.0, 1000.001, -1500.0]


@pytest.fixture(scope='module')
def make_answering(make_settings, table_rows):
    """Return a function that begins to answer at `START`."""

    def make(**parameters):
        answering, chosen = Answering(), make_settings(switching='always', **parameters)
        answering.watch.note(START)
        answering.begin(chosen, chosen.table(*table_rows), START)
        return answering

    return make


@st.composite
def samples(draw):
    """Stamps (ns) and displacements (m): mostly in time and believable, with doubtful ones between."""
    steps = draw(st.lists(st.sampled_from([*PERIODS * 4, *ODD]), min_size=1, max_size=60))
    steps = [step for step in steps for _ in range(draw(st.integers(1, 6)) if step in PERIODS else 1)]
    stamps = START + np.round(MS * np.cumsum(steps)).astype(np.int64)
    numbers = np.random.default_rng(draw(st.integers(0, 2**32))).uniform(-0.002, 0.002, len(steps))
    for place in draw(st.lists(st.integers(0, len(steps) - 1), max_size=8)):
        numbers[place] = draw(st.sampled_from([math.nan, math.inf, 0.02, 0.021, -5.0]))
    return stamps, numbers


ANY_MOTION = {'displacement_velocity': 100.0, 'displacement_noise': 0.1}
"""So that what the samples are drawn from is believed."""


@settings(deadline=None, max_examples=200)
@given(samples(), st.lists(st.integers(0, 59), max_size=3), st.sampled_from([{}, ANY_MOTION]))
def test_many_answers_are_single_answers_to_the_bit(
    make_answering, make_settings, given_samples, places, limits
):
    stamps, displacements = given_samples
    changes = {place: [make_settings('viscous_4000', quality=0.7)] for place in places if place < len(stamps)}
    single, many = make_answering(**limits), make_answering(**limits)
    answers = many.answer_many(stamps, displacements, changes)
    for place, (stamp, displacement) in enumerate(zip(stamps.tolist(), displacements.tolist(), strict=True)):
        for changed in changes.get(place, ()):
            single.change(changed)
        answer = single.answer(stamp, displacement)
        expected = math.nan if answer.current is None else answer.current
        np.testing.assert_equal(answers.currents[place], expected)
        assert answers.traced[place] == (answer.trace is not None)
        assert answers.traces[place].tobytes() == (answer.trace or bytes(many.trace_type.itemsize))
    assert many.watch.counts == single.watch.counts
    assert (many.watch.first, many.watch.last) == (single.watch.first, single.watch.last)
    assert (many.refusal, many.faults) == (single.refusal, single.faults)
    # and both go on alike
    following = int(stamps.max()) + MS
    assert many.expects(following) == single.expects(following)
    assert many.answer(following, 0.001) == single.answer(following, 0.001)


@pytest.mark.parametrize('odd', [math.nan, 0.01])
def test_a_doubt_after_more_than_a_second_without_one_is_no_interruption(make_answering, sine, odd):
    stamps, displacements = START + MS * np.arange(1, 4001), sine(8.0, 1e-3, 4.0)
    displacements[2000] = odd
    single, many = make_answering(), make_answering()
    answers = many.answer_many(stamps, displacements)
    pairs = zip(stamps, displacements, strict=True)
    expected = [single.answer(int(stamp), float(x)).current for stamp, x in pairs]
    np.testing.assert_array_equal(answers.currents, expected)
    assert many.watch.counts == single.watch.counts
    assert many.refusal == ''
    assert max(expected[3100:]) > 0.4


def test_two_parts_are_the_whole(make_answering, sine):
    stamps, displacements = START + MS * np.arange(1, 601), sine(8.0, 1e-3, 0.6)
    parts, whole = make_answering(), make_answering()
    found = [parts.answer_many(stamps[part], displacements[part]) for part in (slice(250), slice(250, 600))]
    expected = whole.answer_many(stamps, displacements)
    assert np.concatenate([answers.traces for answers in found]).tobytes() == expected.traces.tobytes()
    assert parts.watch.counts == whole.watch.counts
    assert expected.currents.max() > 0.5


def test_an_answer_says_why(make_answering):
    answering = make_answering()
    reasons = [
        answering.answer(START + round(ms * MS), displacement).reason
        for ms, displacement in ((0, 0.0), (1, 0.0), (2, math.nan), (3, 0.001), (3, 0.001), (1004, 0.0))
    ]
    assert reasons == [
        Judgement.EARLY, Judgement.RESTART, Judgement.INVALID, Judgement.USE, Judgement.IGNORE,
        Judgement.INTERRUPTED,
    ]  # fmt: skip
    assert answering.refusal.startswith('the measurements were interrupted for more than 1 s')
    answering.end()
    assert answering.answer(START + 1005 * MS, 0.0) == Answer(None, None, Judgement.INACTIVE)
    assert answering.watch.last == START + 1005 * MS


def test_the_answer_is_the_controller_s(make_answering, make_settings, table_rows, sine):
    answering, chosen = make_answering(), make_settings(switching='always')
    controller = Controller(ControlLaw(chosen, chosen.table(*table_rows)))
    for number, displacement in enumerate(sine(8.0, 1e-3, 0.3), 1):
        answer = answering.answer(START + number * MS, displacement)
        assert answer.current == controller.step(displacement)
        assert answer.trace == controller.trace_bytes
    assert answering.current == answer.current > 0.4
    assert answering.damping_active


def test_a_change_waits_for_the_next_sample_that_can_be_used(make_answering, make_settings):
    answering = make_answering()
    answering.answer(START + MS, 0.0)
    answering.change(make_settings('viscous_1000'), 'weaker')
    assert not answering.expects(START + 2 * MS)
    told = [answering.answer(START + place * MS, x).told for place, x in ((2, math.nan), (3, 0.0), (4, 0.0))]
    assert told == [(), ('weaker',), ()]
    assert answering.expects(START + 5 * MS)


def test_a_new_beginning_forgets_what_was_before(make_answering, make_settings, table_rows, sine):
    answering = make_answering()
    answering.answer_many(START + MS * np.arange(1, 301), sine(8.0, 1e-3, 0.3))
    answering.change(make_settings('viscous_1000'), 'weaker')
    answering.controller.memory.window[:] = math.nan
    answering.answer(START + 301 * MS, 0.0)
    assert (answering.faults, answering.last_fault) == (1, START + 301 * MS)
    chosen = make_settings()
    answering.begin(chosen, chosen.table(*table_rows), START + 301 * MS)
    assert (answering.faults, answering.last_fault, answering.watch.counts.samples) == (0, 0, 0)
    answer = answering.answer(START + 302 * MS, 0.0)
    assert (answer.current, answer.reason, answer.told) == (OFF, Judgement.RESTART, ())
