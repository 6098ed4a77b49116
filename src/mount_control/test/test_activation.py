"""A table is used only for the measurements that it was made in."""

import pytest

from mount_control.activation import MeasurementStream, check_belongs
from mount_control.force_to_current import ForceTableError

MS, S = 1_000_000, 1_000_000_000


def _stream(*stamps):
    stream = MeasurementStream()
    for stamp in stamps:
        stream.note(stamp)
    return stream


def _refusal(table, air_gap, stream):
    with pytest.raises(ForceTableError) as caught:
        check_belongs(table, air_gap, stream)
    return str(caught.value)


def test_a_table_of_the_present_stream_is_accepted():
    check_belongs(4 * S, 4 * S, _stream(3 * S, 4 * S, 5 * S))
    check_belongs(3 * S, 3 * S, _stream(3 * S))


def test_without_table_or_air_gap_it_is_refused():
    stream = _stream(S)
    assert _refusal(None, S, stream) == 'no current_force_table was received; activate mount_init (again)'
    assert _refusal(S, None, stream) == 'no air_gap was received; activate mount_init (again)'
    assert 'no current_force_table' in _refusal(None, None, stream)


def test_table_and_air_gap_of_different_activations_are_refused():
    assert _refusal(4 * S, 3 * S, _stream(S, 2 * S, 3 * S, 4 * S)) == (
        'current_force_table (activation 4.000 s) and air_gap (activation 3.000 s) are of different '
        'activations; activate mount_init (again)'
    )


def test_without_displacement_it_is_refused():
    assert _refusal(S, S, MeasurementStream()) == (
        'no displacement was received; activate mount_driver first'
    )


def test_a_table_from_before_a_break_is_refused():
    assert _refusal(2 * S, 2 * S, _stream(S, 2 * S, 4 * S, 5 * S)) == (
        'current_force_table is of 2.000 s, but the measurements restarted at 4.000 s; '
        'activate mount_init (again)'
    )


def test_a_table_from_before_the_time_went_back_is_refused():
    stream = _stream(100 * S, 101 * S, 5 * S, 6 * S)
    assert 'newest displacement is of 6.000 s: the time of the measurements went back' in _refusal(
        101 * S, 101 * S, stream
    )


def test_up_to_one_second_of_silence_is_no_break():
    assert _stream(S, 2 * S).start == S
    assert _stream(S, 2 * S + 1).start == 2 * S + 1


def test_a_repeated_or_overtaken_sample_is_no_break():
    stream = _stream(10 * S, 10 * S + 2 * MS, 10 * S + MS, 10 * S + MS)
    assert (stream.start, stream.last) == (10 * S, 10 * S + 2 * MS)
    assert stream.holds(10 * S + MS)


def test_a_stream_holds_what_happened_during_it():
    stream = _stream(S, 2 * S, 3 * S)
    assert [stream.holds(stamp) for stamp in (S - 1, S, 2 * S, 3 * S, 3 * S + 1)] == [
        False, True, True, True, False
    ]  # fmt: skip
    assert not MeasurementStream().holds(0)
