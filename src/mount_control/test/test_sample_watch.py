"""Each displacement sample is judged by its stamp and value before the controller sees it."""

import math
import random

import pytest

from mount_control.force_to_current import ForceTableError
from mount_control.parameters import ControlParameters
from mount_control.sample_watch import Judgement, SampleCounts, SampleWatch

MS, S = 1_000_000, 1_000_000_000  # ns


@pytest.fixture
def watch():
    watch = SampleWatch()
    watch.note(600 * MS)
    watch.begin(600 * MS, ControlParameters())
    assert _judge(watch, 0) == [(Judgement.RESTART, 0)]  # the first one has no past
    return watch


def _judge(watch, *milliseconds, displacement=0.0):
    judged = []
    for stamp in (round(1000 * MS + ms * MS) for ms in milliseconds):
        watch.note(stamp)
        judged.append(watch.judge(stamp, displacement))
    return judged


def test_samples_in_time_are_used(watch):
    assert _judge(watch, 1, 2, 3) == [(Judgement.USE, 0)] * 3
    assert watch.counts == SampleCounts(samples=4, restarts=1)
    assert watch.expects(1004 * MS)
    assert not watch.expects(1005 * MS)


@pytest.mark.parametrize('jitter', [-0.49, -0.1, 0.1, 0.49])
def test_a_stamp_a_little_early_or_late_is_no_missing_sample(watch, jitter):
    assert _judge(watch, 1 + jitter) == [(Judgement.USE, 0)]


@pytest.mark.parametrize('missing', [1, 2, 7, 19])
def test_missing_samples_are_counted_from_the_stamps(watch, missing):
    assert _judge(watch, missing + 1) == [(Judgement.USE, missing)]
    assert watch.counts.bridged == missing


def test_after_too_long_a_gap_the_past_is_forgotten(watch):
    assert _judge(watch, 20.000001, 21) == [(Judgement.RESTART, 0), (Judgement.USE, 0)]
    assert watch.counts == SampleCounts(samples=3, restarts=2)


@pytest.mark.parametrize('late_by', [0, 1, 300])
def test_repeated_and_overtaken_samples_are_ignored(watch, late_by):
    _judge(watch, 1, 2)
    assert _judge(watch, 2 - late_by) == [(Judgement.IGNORE, 0)]
    assert watch.counts.ignored == 1
    assert _judge(watch, 3) == [(Judgement.USE, 0)]


@pytest.mark.parametrize('displacement', [math.nan, math.inf, -math.inf, 0.020001, -0.020001])
def test_what_no_sensor_can_mean_is_invalid(watch, displacement):
    assert _judge(watch, 1, displacement=displacement) == [(Judgement.INVALID, 0)]
    assert watch.counts.invalid == 1
    assert watch.counts.samples == 1


@pytest.mark.parametrize('displacement', [0.020, -0.020])
def test_the_end_of_the_range_still_counts(watch, displacement):
    _judge(watch, *range(1, 20), displacement=math.nan)  # so that it can have moved there
    assert _judge(watch, 20, displacement=displacement) == [(Judgement.USE, 19)]


def test_invalid_samples_are_bridged_like_missing_ones(watch):
    _judge(watch, 1, 2, 3, displacement=math.nan)
    assert _judge(watch, 4) == [(Judgement.USE, 3)]
    _judge(watch, *range(5, 30), displacement=math.nan)
    assert _judge(watch, 30) == [(Judgement.RESTART, 0)]


# Does a table belong to the present measurements?


def _stream(*stamps):
    stream = SampleWatch()
    for stamp in stamps:
        stream.note(stamp)
    return stream


def _refusal(table, air_gap, stream):
    with pytest.raises(ForceTableError) as caught:
        stream.check_belongs(table, air_gap)
    return str(caught.value)


def test_a_table_of_the_present_stream_is_accepted():
    _stream(3 * S, 4 * S, 5 * S).check_belongs(4 * S, 4 * S)
    _stream(3 * S).check_belongs(3 * S, 3 * S)


def test_without_table_or_air_gap_it_is_refused():
    stream = _stream(S)
    assert (
        _refusal(None, S, stream)
        == 'no current_force_table was received (0 messages, needed is 1); activate mount_init (again)'
    )
    assert (
        _refusal(S, None, stream)
        == 'no air_gap was received (0 messages, needed is 1); activate mount_init (again)'
    )
    assert 'no current_force_table' in _refusal(None, None, stream)


def test_table_and_air_gap_of_different_activations_are_refused():
    assert _refusal(4 * S, 3 * S, _stream(S, 2 * S, 3 * S, 4 * S)) == (
        'current_force_table (activation 4.000 s) and air_gap (activation 3.000 s) are of different '
        'activations; activate mount_init (again)'
    )


def test_without_displacement_it_is_refused():
    assert _refusal(S, S, SampleWatch()) == ('no displacement was received; activate mount_driver first')


def test_a_table_from_before_a_break_is_refused():
    assert _refusal(2 * S, 2 * S, _stream(S, 2 * S, 4 * S, 5 * S)) == (
        'current_force_table is of 2.000 s, but the measurements were interrupted or went back, and came '
        'anew at 4.000 s; activate mount_init (again)'
    )


def test_a_table_from_before_the_node_heard_the_measurements_is_refused_for_that_reason():
    assert _refusal(2 * S, 2 * S, _stream(4 * S, 5 * S)) == (
        'current_force_table is of 2.000 s, but mount_control hears the measurements since 4.000 s only, '
        'when it was configured, and cannot know that they have come without a break since the table; '
        'activate mount_init (again)'
    )


def test_a_table_from_before_the_time_went_back_is_refused():
    stream = _stream(100 * S, 101 * S, 5 * S, 6 * S)
    assert 'newest displacement is of 6.000 s: the time of the measurements went back' in _refusal(
        101 * S, 101 * S, stream
    )


def test_up_to_one_second_of_silence_is_no_break():
    assert _stream(S, 2 * S).first == S
    assert _stream(S, 2 * S + 1).first == 2 * S + 1


def test_a_repeated_or_overtaken_sample_is_no_break():
    stream = _stream(10 * S, 10 * S + 2 * MS, 10 * S + MS, 10 * S + MS)
    assert (stream.first, stream.last) == (10 * S, 10 * S + 2 * MS)


def test_a_sample_is_answered_only_where_the_table_was_made_during_the_present_measurements():
    for activation, expected in (
        (S - 1, Judgement.INTERRUPTED),
        (S, Judgement.RESTART),
        (2 * S, Judgement.RESTART),
        (3 * S, Judgement.EARLY),
        (3 * S + 1, Judgement.INTERRUPTED),
    ):
        stream = _stream(S, 2 * S, 3 * S)
        stream.begin(activation, ControlParameters())
        assert stream.judge(3 * S, 0.0) == (expected, 0)
        assert stream.interrupted == (expected is Judgement.INTERRUPTED)


def test_an_interruption_stands_until_the_next_activation(watch):
    assert _judge(watch, 1, 1002, 1003) == [(Judgement.USE, 0), *[(Judgement.INTERRUPTED, 0)] * 2]
    watch.begin(2003 * MS, ControlParameters())
    assert _judge(watch, 1004) == [(Judgement.RESTART, 0)]
    assert watch.counts == SampleCounts(samples=1, restarts=1)


def test_a_controller_made_for_another_rate_is_not_activated():
    stream = SampleWatch()
    for k in range(200):
        stream.note(S + k * MS // 2)
    with pytest.raises(ForceTableError, match='at 2000 Hz, but sample_rate of mount_control is 1000 Hz'):
        stream.check_rate(1000.0)
    stream.check_rate(2000.0)


def test_lost_samples_are_no_other_rate():
    stream, numbers = SampleWatch(), random.Random(1)
    for k in range(400):
        if numbers.random() < 0.4:  # 60 % are lost on an overloaded machine
            stream.note(S + k * MS)
    stream.check_rate(1000.0)
    with pytest.raises(ForceTableError, match='at 1000 Hz'):
        stream.check_rate(2000.0)


def test_samples_at_2_khz_are_bridged_by_their_own_period():
    stream = SampleWatch()
    stream.note(600 * MS)
    stream.begin(600 * MS, ControlParameters(sample_rate=2000.0))
    judged = _judge(stream, 0.0, 0.5, 1.5, 2.0)
    assert judged[1:] == [(Judgement.USE, 0), (Judgement.USE, 1), (Judgement.USE, 0)]


@pytest.mark.parametrize(
    'stamps',
    [
        (1, 1.5, 2, 2.5),  # a second sender half a sample beside the first
        (1, 1.2, 2, 2.2, 3, 3.2),
        (1, 1, 2, 2, 3, 3),  # one that repeats the stamps of the other
        (1, 2, 3, 1, 4, 2, 5, 3),  # one that is behind
    ],
)
def test_a_second_sender_is_noticed_by_its_stamps_and_answered_with_0_ampere(watch, stamps):
    judged = [judgement for judgement, _ in _judge(watch, *stamps)]
    assert judged[-1] is Judgement.FOREIGN
    assert watch.foreign == (
        '3 displacement samples within 1 s were repeated, older than the one before or less than 0.75 ms '
        'behind it: end one of the two nodes that publish displacement'
    )
    assert _judge(watch, 100, 101) == [(Judgement.FOREIGN, 0)] * 2
    watch.begin(1100 * MS, ControlParameters())
    assert _judge(watch, 101) == [(Judgement.RESTART, 0)]


def test_a_sender_noticed_by_its_stamps_is_told_by_its_name_as_soon_as_discovery_has_it(watch):
    _judge(watch, 1, 1, 2, 2, 3, 3)
    assert watch.nameless
    watch.on_publisher_conflict('', '')
    assert watch.foreign.startswith('3 displacement samples within 1 s were repeated')
    for name in ('/evil', '/worse'):
        watch.on_publisher_conflict(f'{name} must not publish', '')
        assert (watch.foreign, watch.nameless) == ('/evil must not publish', False)
    watch.begin(600 * MS, ControlParameters())
    assert (watch.foreign, watch.nameless) == ('', False)


def test_repeated_samples_now_and_then_are_no_second_sender(watch):
    for second in range(5):
        begin = 800 * second
        assert _judge(watch, begin + 1, begin + 1)[1] == (Judgement.IGNORE, 0)
        _judge(watch, *range(begin + 2, begin + 800))
    assert watch.foreign == ''


def test_while_another_writer_is_in_doubt_samples_are_answered_with_0_ampere(watch):
    watch.writer_doubt = 'mount_driver_io is there twice'
    assert _judge(watch, 1, 2) == [(Judgement.FOREIGN, 0)] * 2
    watch.writer_doubt = ''
    assert _judge(watch, 3, 4) == [(Judgement.USE, 2), (Judgement.USE, 0)]
