"""The table of an activation belongs to the measurements that come now, or is refused."""

import random

import pytest

from mount_control.activation import check_belongs, check_rate
from mount_control.control_loop import ControlLoop
from mount_control.force_maker import ForceTableError

MS, S = 1_000_000, 1_000_000_000  # ns


def _stream(*stamps):
    stream = ControlLoop()
    for stamp in stamps:
        stream.note(stamp)
    return stream


def _refusal(table, air_gap, stream):
    with pytest.raises(ForceTableError) as caught:
        check_belongs(stream, table, air_gap)
    return str(caught.value)


def test_a_table_of_the_present_stream_is_accepted():
    check_belongs(_stream(3 * S, 4 * S, 5 * S), 4 * S, 4 * S)
    check_belongs(_stream(3 * S), 3 * S, 3 * S)


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
    assert _refusal(S, S, _stream()) == 'no displacement was received; activate mount_driver first'


def test_table_and_air_gap_of_different_activations_are_refused():
    assert _refusal(4 * S, 3 * S, _stream(S, 2 * S, 3 * S, 4 * S)) == (
        'current_force_table (activation 4.000 s) and air_gap (activation 3.000 s) are of different '
        'activations; activate mount_init (again)'
    )


def test_a_table_from_before_a_break_is_refused():
    assert _refusal(2 * S, 2 * S, _stream(S, 2 * S, 4 * S, 5 * S)) == (
        'current_force_table is of 2.000 s, but the measurements were interrupted or went back, and came '
        'anew at 4.000 s; activate mount_init (again)'
    )


def test_a_table_from_before_the_node_received_the_measurements_is_refused_for_that_reason():
    assert _refusal(2 * S, 2 * S, _stream(4 * S, 5 * S)) == (
        'current_force_table is of 2.000 s, but mount_control has received the measurements since 4.000 s '
        'only, when it was configured, and cannot know that they have come without a break since the table; '
        'activate mount_init (again)'
    )


def test_a_table_from_before_the_time_went_back_is_refused():
    stream = _stream(100 * S, 101 * S, 5 * S, 6 * S)
    assert 'newest displacement is of 6.000 s: the time of the measurements went back' in _refusal(
        101 * S, 101 * S, stream
    )


def test_a_repeated_or_overtaken_sample_is_no_break():
    stream = _stream(10 * S, 10 * S + 2 * MS, 10 * S + MS, 10 * S + MS)
    assert (stream.first, stream.last) == (10 * S, 10 * S + 2 * MS)
    assert _stream(S, 2 * S).first == S  # nor is a second of silence
    assert _stream(S, 2 * S + 1).first == 2 * S + 1


def test_a_controller_made_for_another_rate_is_not_activated():
    stream = ControlLoop()
    for k in range(200):
        stream.note(S + k * MS // 2)
    with pytest.raises(ForceTableError, match='at 2000 Hz, but sample_rate of mount_control is 1000 Hz'):
        check_rate(stream, 1000.0)
    check_rate(stream, 2000.0)


def test_lost_samples_are_no_other_rate():
    stream, numbers = ControlLoop(), random.Random(1)
    for k in range(400):
        if numbers.random() < 0.4:  # 60 % are lost on an overloaded machine
            stream.note(S + k * MS)
    check_rate(stream, 1000.0)
    with pytest.raises(ForceTableError, match='at 1000 Hz'):
        check_rate(stream, 2000.0)
