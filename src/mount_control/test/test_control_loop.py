"""The way of a sample to its answer, one by one and many at once."""

import math

import numpy as np
import pytest
from controllers import TABLE_ROWS, make_settings, sine
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_control import control_loop
from mount_control.control_loop import OFF, ControlLoop, Judgement, SampleCounts

MS, S, START = 1_000_000, 1_000_000_000, 5_000_000_000  # ns
PERIODS = [0.999, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.001, 1.49]  # ms
ODD = [-3.0, -0.5, 0.0, 0.2, 1.5, 2.0, 5.0, 19.9, 21.0, 30.0, 1000.001, -1500.0]


@pytest.fixture(scope='module')
def make_loop():
    """Return a function that begins to answer at `START`."""

    def make(**parameters):
        loop, chosen = ControlLoop(), make_settings(switching='always', **parameters)
        loop.note(START)
        loop.begin(chosen, chosen.table(*TABLE_ROWS), START)
        return loop

    return make


def trace_of(loop):
    """The bytes of the trace of the last sample, empty where there is none."""
    return b'' if loop.trace is None else loop.trace.tobytes()


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
def test_many_answers_are_single_answers_to_the_bit(make_loop, given_samples, places, limits):
    stamps, displacements = given_samples
    changes = {place: [make_settings('viscous_4000', quality=0.7)] for place in places if place < len(stamps)}
    single, many = make_loop(**limits), make_loop(**limits)
    frequencies = 20.0 + np.arange(len(stamps))
    answers = many.step_many(stamps, displacements, changes, frequencies)
    columns = (each.tolist() for each in (stamps, displacements, frequencies))
    for place, sample in enumerate(zip(*columns, strict=True)):
        for changed in changes.get(place, ()):
            single.change(changed)
        current = single.step(*sample)
        expected = math.nan if current is None else current
        np.testing.assert_equal(answers.currents[place], expected)
        assert answers.traced[place] == (single.trace is not None)
        assert answers.traces[place].tobytes() == (trace_of(single) or bytes(many.trace_type.itemsize))
    assert many.counts == single.counts
    assert (many.first, many.last) == (single.first, single.last)
    assert (many.refusal, many.faults) == (single.refusal, single.faults)
    # and both go on alike
    following = int(stamps.max()) + MS
    assert many.expects(following) == single.expects(following)
    assert many.step(following, 0.001) == single.step(following, 0.001)
    assert (many.judgement, trace_of(many)) == (single.judgement, trace_of(single))


@pytest.mark.parametrize('odd', [math.nan, 0.01])
def test_a_doubt_after_more_than_a_second_without_one_is_no_interruption(make_loop, odd):
    stamps, displacements = START + MS * np.arange(1, 4001), sine(8.0, 1e-3, 4.0)
    displacements[2000] = odd
    single, many = make_loop(), make_loop()
    answers = many.step_many(stamps, displacements)
    pairs = zip(stamps, displacements, strict=True)
    expected = [single.step(int(stamp), float(x)) for stamp, x in pairs]
    np.testing.assert_array_equal(answers.currents, expected)
    assert many.counts == single.counts
    assert many.refusal == ''
    assert max(expected[3100:]) > 0.4


def test_a_change_waits_for_the_next_sample_that_can_be_used(make_loop):
    loop = make_loop()
    loop.step(START + MS, 0.0)
    loop.change(make_settings('viscous_1000'), 'weaker')
    assert not loop.expects(START + 2 * MS)
    made = []
    for place, displacement in ((2, math.nan), (3, 0.0), (4, 0.0)):
        loop.step(START + place * MS, displacement)
        made.append(list(loop.changes_made))
        loop.changes_made.clear()
    assert made == [[], ['weaker'], []]
    assert loop.expects(START + 5 * MS)


@pytest.mark.parametrize('place', ['_refusal', '_make_changes', 'doubt_of'])
def test_a_change_that_comes_amid_a_step_is_made_at_that_sample_or_the_next(make_loop, monkeypatch, place):
    loop, stronger = make_loop(), make_settings('viscous_4000')
    loop.step(START + MS, 0.0)
    owner = control_loop if place == 'doubt_of' else loop
    original, steps = getattr(owner, place), []

    def amid(*arguments):
        found = original(*arguments)
        if not steps:
            loop.change(stronger, 'stronger')
        steps.append(place)
        return found

    monkeypatch.setattr(owner, place, amid)
    for ms in (3, 4, 5):  # the first of them behind a gap
        loop.step(START + ms * MS, 0.0)
    assert steps
    assert list(loop.changes_made) == ['stronger']


def test_a_new_beginning_forgets_what_was_before(make_loop):
    loop = make_loop()
    loop.step_many(START + MS * np.arange(1, 301), sine(8.0, 1e-3, 0.3))
    loop.change(make_settings('viscous_1000'), 'weaker')
    loop.controller.memory.window[:] = math.nan
    loop.step(START + 301 * MS, 0.0)
    assert loop.faults == 1
    loop.changes_made.clear()
    chosen = make_settings()
    loop.begin(chosen, chosen.table(*TABLE_ROWS), START + 301 * MS)
    assert (loop.faults, loop.counts.samples) == (0, 0)
    assert loop.step(START + 302 * MS, 0.0) == OFF
    assert (loop.judgement, list(loop.changes_made)) == (Judgement.RESTART, [])


# What becomes of a sample, by its stamp and value.


@pytest.fixture
def loop(make_loop):
    loop = make_loop()
    assert judged(loop, 400) == [(Judgement.RESTART, 0)]  # the first one has no past
    return loop


def judged(loop, *milliseconds, displacement=0.0):
    """Judgements on samples so many ms after `START`, and how many missing ones were bridged before each."""
    found = []
    for ms in milliseconds:
        before = loop.counts.bridged
        current = loop.step(START + round(ms * MS), displacement)
        assert (current is None) == (loop.judgement in UNANSWERED)
        assert (loop.trace is not None) == (loop.judgement in CONTROLLED)
        assert current in (None, OFF) or loop.judgement in CONTROLLED
        found.append((loop.judgement, loop.counts.bridged - before))
    return found


UNANSWERED = (Judgement.IGNORE, Judgement.EARLY, Judgement.INACTIVE)
CONTROLLED = (Judgement.USE, Judgement.RESTART)


def test_each_sample_has_its_judgement(make_loop):
    loop = make_loop()
    cases = ((0, 0.0), (1, 0.0), (2, math.nan), (3, 0.001), (3, 0.001), (1004, 0.0))
    assert [judged(loop, ms, displacement=displacement)[0][0] for ms, displacement in cases] == [
        Judgement.EARLY, Judgement.RESTART, Judgement.INVALID, Judgement.USE, Judgement.IGNORE,
        Judgement.INTERRUPTED,
    ]  # fmt: skip
    assert loop.refusal.startswith('the measurements were interrupted for more than 1 s')
    loop.end()
    assert judged(loop, 1005) == [(Judgement.INACTIVE, 0)]
    assert loop.last == START + 1005 * MS


@pytest.mark.parametrize(
    ('ms', 'displacement', 'judgement', 'missing'),
    [
        *((401, x, Judgement.INVALID, 0) for x in (math.nan, math.inf, -math.inf, 0.020001, -0.020001)),
        *((401 + jitter, 0.0, Judgement.USE, 0) for jitter in (-0.49, -0.1, 0.1, 0.49)),
        *((401 + missing, 0.0, Judgement.USE, missing) for missing in (1, 2, 7, 19)),
        (420.000001, 0.0, Judgement.RESTART, 0),
        *((ms, 0.0, Judgement.IGNORE, 0) for ms in (400, 399, 100)),
    ],
)
def test_what_becomes_of_a_sample_behind_another(loop, ms, displacement, judgement, missing):
    assert judged(loop, ms, displacement=displacement) == [(judgement, missing)]
    kept = judgement in CONTROLLED
    assert loop.counts == SampleCounts(
        samples=1 + kept,
        bridged=missing,
        restarts=1 + (judgement is Judgement.RESTART),
        ignored=int(judgement is Judgement.IGNORE),
        invalid=int(judgement is Judgement.INVALID),
    )
    if kept:
        assert loop.controller.trace['bridged_samples'] == missing
    assert judged(loop, 421)[0][0] is (Judgement.USE if kept and ms > 401 else Judgement.RESTART)


def test_invalid_samples_are_bridged_like_missing_ones(loop):
    judged(loop, 401, 402, 403, displacement=math.nan)
    assert judged(loop, 404) == [(Judgement.USE, 3)]
    judged(loop, *range(405, 430), displacement=math.nan)
    assert judged(loop, 430) == [(Judgement.RESTART, 0)]


def test_a_sample_is_answered_only_where_the_table_was_made_during_the_present_measurements():
    chosen = make_settings()
    for activation, expected in (
        (S - 1, Judgement.INTERRUPTED),
        (S, Judgement.RESTART),
        (2 * S, Judgement.RESTART),
        (3 * S, Judgement.EARLY),
        (3 * S + 1, Judgement.INTERRUPTED),
    ):
        loop = ControlLoop()
        for stamp in (S, 2 * S, 3 * S):
            loop.note(stamp)
        loop.begin(chosen, chosen.table(*TABLE_ROWS), activation)
        loop.step(3 * S, 0.0)
        assert loop.judgement is expected
        assert bool(loop.refusal) == (expected is Judgement.INTERRUPTED)


def test_an_interruption_stands_until_the_next_activation(loop):
    assert judged(loop, 401, 1402, 1403) == [(Judgement.USE, 0), *[(Judgement.INTERRUPTED, 0)] * 2]
    chosen = make_settings()
    loop.begin(chosen, chosen.table(*TABLE_ROWS), START + 1403 * MS)
    assert judged(loop, 1404) == [(Judgement.RESTART, 0)]
    assert loop.counts == SampleCounts(samples=1, restarts=1)


def test_samples_at_2_khz_are_bridged_by_their_own_period(make_loop):
    expected = [(Judgement.USE, 0), (Judgement.USE, 1), (Judgement.USE, 0)]
    assert judged(make_loop(sample_rate=2000.0), 400.0, 400.5, 401.5, 402.0)[1:] == expected


@pytest.mark.parametrize(
    'stamps',
    [
        (1, 1.5, 2, 2.5),  # a second sender half a sample beside the first
        (1, 1.2, 2, 2.2, 3, 3.2),
        (1, 1, 2, 2, 3, 3),  # one that repeats the stamps of the other
        (1, 2, 3, 1, 4, 2, 5, 3),  # one that is behind
    ],
)
def test_a_second_sender_is_noticed_by_its_stamps_and_answered_with_0_ampere(loop, stamps):
    assert judged(loop, *(400 + ms for ms in stamps))[-1] == (Judgement.FOREIGN, 0)
    assert loop.foreign == (
        '3 displacement samples within 1 s were repeated, older than the one before or less than 0.75 ms '
        'behind it: end one of the two nodes that publish displacement'
    )
    assert judged(loop, 500, 501) == [(Judgement.FOREIGN, 0)] * 2
    chosen = make_settings()
    loop.begin(chosen, chosen.table(*TABLE_ROWS), START + 500 * MS)
    assert judged(loop, 501) == [(Judgement.RESTART, 0)]


def test_another_writer_is_heeded_from_the_next_usual_sample_on(loop):
    assert judged(loop, 401, 402) == [(Judgement.USE, 0)] * 2
    loop.on_publisher_conflict('', 'mount_driver_io is there twice')
    assert judged(loop, 403, 404) == [(Judgement.FOREIGN, 0)] * 2
    loop.on_publisher_conflict('', '')
    assert judged(loop, 405, 406) == [(Judgement.USE, 2), (Judgement.USE, 0)]
    loop.on_publisher_conflict('/evil must not publish', '')
    loop.on_publisher_conflict('', '')
    assert judged(loop, 407, 408) == [(Judgement.FOREIGN, 0)] * 2
    assert loop.foreign == '/evil must not publish'
