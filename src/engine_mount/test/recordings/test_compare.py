"""Comparing two recordings: words, figures, and what counts as a difference."""

import json

import numpy as np
import pytest
from compared_drives import START, answers, write_answers

import engine_mount
from engine_mount.recordings.compare import compare
from engine_mount.recordings.difference import ToleranceError, Tolerances
from engine_mount.recordings.matching import ComparisonError

COUNT = 400
LIVE = START + 90_000_000_317  # ns: another start, as of a second drive
SIGNALS = answers(COUNT)


@pytest.fixture
def compared(tmp_path):
    """Compare a drive with one that has other signals or was written otherwise."""

    def run(signals=SIGNALS, tolerances=(), common_only=False, first=SIGNALS, first_options=None, **options):
        a = write_answers(tmp_path / 'a', first, **(first_options or {}))
        b = write_answers(tmp_path / 'b', signals, **options)
        both = engine_mount.open(a), engine_mount.open(b)
        return compare(*both, Tolerances(tolerances), common_only=common_only)

    return run


def _changed(name: str, place: int, value: float) -> dict[str, np.ndarray]:
    values = SIGNALS[name].copy()
    values[place] = value
    return {**SIGNALS, name: values}


def _signal(comparison, name: str):
    return next(signal for signal in comparison.signals if signal.name == name)


def test_a_recording_equals_itself_to_the_bit_with_all_its_nans(compared):
    comparison = compared()
    assert comparison.equal
    assert np.isnan(SIGNALS['friction_coefficient']).any()
    assert comparison.sentences() == ['everything is equal to the bit (16 signals of 4 topics)']


def test_the_smallest_difference_is_found_with_place_and_values(compared):
    value = np.nextafter(SIGNALS['current'][150], 9.0)
    comparison = compared(_changed('current', 150, value))
    assert not comparison.equal
    signal = _signal(comparison, 'current_setpoint.coil_current')
    assert (signal.differing, signal.first, signal.largest) == (1, signal.largest, signal.first)
    assert (signal.first.a, signal.first.b) == (SIGNALS['current'][150], value)
    assert signal.first.time == pytest.approx(0.15, abs=1e-9)


def test_the_sign_of_a_zero_is_a_difference_without_a_tolerance_only(compared):
    comparison = compared(_changed('current', 10, -0.0))
    sentence = 'current_setpoint.coil_current differs in the sign of zero, first at 0.010 s'
    assert sentence in comparison.sentences()
    assert not comparison.equal


@pytest.mark.parametrize(
    ('tolerances', 'equal'),
    [
        (('coil_current=0.011', 'current=0.011'), True),
        (('coil_current=0.009', 'current=0.011'), False),
        (('current_setpoint=0.011', 'control_trace.current=0.011'), True),
        (('2%',), True),
        (('0.5%',), False),
        (('0.5%', 'coil_current=0.011', 'current=2%'), True),
    ],
)
def test_a_tolerance_is_kept_to_by_signal_topic_or_share(compared, tolerances, equal):
    assert compared(_changed('current', 200, SIGNALS['current'][200] + 0.01), tolerances).equal is equal


def test_a_tolerance_for_no_signal_is_refused(compared):
    with pytest.raises(ToleranceError, match='no such signal in both recordings; --json lists'):
        compared(tolerances=('curent=0.01',))


@pytest.mark.parametrize('text', ['0.01', 'current', 'current=x', 'switching=1%', 'current=-1', '1.2.3%'])
def test_a_tolerance_that_means_nothing_is_refused(text):
    with pytest.raises(ToleranceError):
        Tolerances([text])


def test_nan_in_one_recording_alone_is_a_difference_whatever_the_tolerance(compared):
    comparison = compared(_changed('displacement', 20, np.nan), ('100%',))
    signal = _signal(comparison, 'displacement.mount')
    assert (signal.differing, signal.unknown_in_one, signal.largest) == (1, 1, None)
    sentence = 'displacement.mount: in one of them 1 sample is unknown, first at 0.020 s'
    assert sentence in comparison.sentences()


# Switching.


def test_a_later_switching_comes_first_in_words(compared):
    comparison = compared(answers(COUNT, on=112))
    assert comparison.sentences()[0] == 'switched on 12 ms later in B, at 0.112 s'
    assert [round(1e3 * change.moved) for change in comparison.switching_changes] == [12]


def test_a_switching_within_its_tolerance_has_not_moved(compared):
    comparison = compared(answers(COUNT, off=298), ('switching=0.002', '100%', 'friction_coefficient=1'))
    assert comparison.switching_changes == []
    assert not comparison.equal  # friction is known in one of them only


def test_switchings_that_vanish_or_appear_are_told(compared):
    never = answers(COUNT, on=COUNT)
    told = compared(never).sentences()
    assert told[:2] == [
        'damping is not switched on in B, in A it is at 0.100 s',
        'damping is not switched off in B, in A it is at 0.300 s',
    ]


# Alignment.


def test_drives_of_other_stamps_are_aligned_at_their_first_displacement(compared):
    comparison = compared(start=LIVE)
    assert comparison.equal
    assert not comparison.alignment.same_stamps
    assert comparison.alignment.shift == START - LIVE
    assert 'B is shifted by -90.000000 s' in comparison.alignment.sentence


def test_a_clock_that_runs_fast_does_not_move_samples(compared):
    """0.5 % over 400 samples are two samples."""
    comparison = compared(start=LIVE, period=1_005_000)
    assert comparison.equal
    assert comparison.switching_changes == []


def test_missing_samples_are_a_difference_and_do_not_move_the_others(compared):
    comparison = compared(start=LIVE, missing=range(50, 60))
    assert not comparison.equal
    assert not comparison.differing
    told = comparison.sentences()
    assert 'samples missing in B: 10 of displacement, 10 of current_setpoint, 10 of control_trace' in told
    assert told[-1].startswith('everything that both have is equal to the bit')


def test_only_the_common_time_counts_if_asked(compared):
    shorter = {name: values[:300] for name, values in SIGNALS.items()}
    assert compared(shorter, common_only=True).equal


def test_recordings_with_nothing_in_common_are_refused(tmp_path, drive):
    empty = {name: values[:0] for name, values in SIGNALS.items()}
    other = write_answers(tmp_path / 'other', empty)
    with pytest.raises(ComparisonError, match='nothing can be matched'):
        compare(engine_mount.open(drive), engine_mount.open(other))


# Reasons.


def test_sessions_that_differ_are_told(compared):
    session = 'scenario: bench\nstarted: {}\nparameters:\n  mount_control:\n    quality: {}\n'
    comparison = compared(
        answers(COUNT, on=112),
        first_options={'session': session.format('now', 0.7)},
        session=session.format('later', 0.9),
    )
    assert 'the sessions differ: mount_control.quality is 0.7 in A, 0.9 in B' in comparison.sentences()


def test_topics_of_one_recording_are_named(drive, tmp_path):
    other = write_answers(tmp_path / 'other', SIGNALS)
    comparison = compare(engine_mount.open(drive), engine_mount.open(other))
    assert comparison.only_a == ('/coil_ripple',)
    assert comparison.only_b == ('/session', '/air_gap', '/control_trace')


# Figures.


def test_json_holds_what_the_words_say_and_no_nan(compared):
    comparison = compared({**answers(COUNT, on=112), 'displacement': SIGNALS['displacement']})
    figures = json.loads(json.dumps(comparison.figures(), allow_nan=False))
    assert figures['equal'] is False
    assert figures['switching'][0] == {
        'mount': '',
        'kind': 'on',
        'time_a_s': pytest.approx(0.1),
        'time_b_s': pytest.approx(0.112),
        'moved_ms': pytest.approx(12.0),
    }
    current = figures['topics']['current_setpoint']['signals']['coil_current']
    assert current['differing'] == 12
    assert current['unit'] == 'A'
