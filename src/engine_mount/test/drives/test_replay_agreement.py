"""Whether a replay gives the recorded answers: to the bit, or as near as a beginning in the middle allows."""

import math
import re

import numpy as np
import pytest

from engine_mount.drives.agreement import SETTLING, agreement, recorded_switching, switching_changes
from engine_mount.drives.core import ControlAnswers, Replayed
from engine_mount.drives.inputs.consumed_samples import ControlRun, RecordedAnswers
from engine_mount.drives.inputs.input import ReplayInput
from engine_mount.recordings.events import Switching
from mount_control.control_loop import SampleCounts
from mount_control.policy import switched_viscous
from mount_control.policy.contract import trace_dtype

TRACE = trace_dtype(switched_viscous)
COUNT = 5000
PERIOD = 1_000_000  # ns
ZERO = 7_000_000_000
STAMPS = ZERO + PERIOD * np.arange(COUNT)
SETTLED = round(SETTLING * 1000)  # samples
CURRENT = 0.5 + 0.4 * np.sin(np.arange(COUNT) / 50.0)


def traces(current: np.ndarray = CURRENT) -> np.ndarray:
    found = np.zeros(COUNT, TRACE)
    found['current'] = current
    found['damping_active'] = np.arange(COUNT) >= 100
    return found


def judged(setpoints=CURRENT, steps=None, *, stamps=STAMPS, from_its_beginning=True):
    """Compare a replay with these answers to a recording of `CURRENT` and its traces."""
    recorded = traces()
    answers = RecordedAnswers(STAMPS, CURRENT, STAMPS, {name: recorded[name] for name in TRACE.names})
    run = ControlRun(STAMPS, np.zeros(COUNT), np.zeros(COUNT), None, from_its_beginning)
    given = ReplayInput('a drive', [run], {}, answers, {}, zero=ZERO)
    steps = traces() if steps is None else steps
    count = len(stamps)
    part = ControlAnswers(stamps, setpoints[:count], np.ones(count, bool), steps[:count], SampleCounts())
    return agreement(given, Replayed([part])), given


def test_the_same_answers_are_equal_to_the_last_bit():
    found, _ = judged()
    assert found.equal
    assert found.agrees
    assert found.sentences == [
        'equal to the recorded setpoints to the last bit (5000 setpoints, 5000 steps with all their '
        'intermediates)'
    ]


def test_the_smallest_difference_is_found_and_told():
    changed = CURRENT.copy()
    changed[1234] = np.nextafter(changed[1234], 9.0)
    found, _ = judged(changed, traces(changed))
    assert not found.agrees
    assert (found.setpoints.differing, found.setpoints.first) == (1, found.setpoints.largest)
    assert found.setpoints.first.time == pytest.approx(1.234)
    assert (found.setpoints.first.a, found.setpoints.first.b) == (CURRENT[1234], changed[1234])
    assert [each.signal for each in found.differing] == ['coil_current', 'current']
    assert found.sentences[0] == '1 of 5000 setpoints differ'
    assert re.match(r'current_setpoint\.coil_current differs .* at 1\.234 s', found.sentences[1])


def test_an_intermediate_alone_is_a_difference():
    steps = traces()
    steps['magnitude'][7] = 1e-9
    found, _ = judged(steps=steps)
    assert not found.equal
    assert not found.setpoints.differing
    assert found.sentences == ['control_trace.magnitude differs by at most 1 nm at 0.007 s, first at 0.007 s']


@pytest.mark.parametrize(('place', 'difference', 'agrees'), [
    (10, 0.1, True), (SETTLED, 1e-7, True), (SETTLED, 1e-5, False), (SETTLED, math.nan, False),
])  # fmt: skip
def test_a_recording_that_begins_in_the_middle_is_met_once_settled(place, difference, agrees):
    changed = CURRENT.copy()
    changed[place] += difference
    found, _ = judged(changed, from_its_beginning=False)
    assert found.settling_skipped == SETTLED
    assert found.setpoints.samples == COUNT - SETTLED
    assert found.agrees is agrees


def test_there_is_nothing_to_compare_where_no_sample_was_recorded():
    assert judged(stamps=STAMPS + PERIOD // 2)[0] is None


def test_switching_is_told_in_the_words_of_a_comparison():
    _, given = judged()
    before = recorded_switching(given)
    assert before == Switching((pytest.approx(0.1),), ())
    assert switching_changes(before, before, 1e-3) == []
    assert switching_changes(before, Switching((0.112,), (0.2,)), 1e-3) == [
        'switched on 12 ms later in the replay, at 0.112 s',
        'damping is switched off at 0.200 s in the replay, in the recording it is not',
    ]
