"""Marks: their text, and those that the recorder sets by itself."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hypothesis import given, settings
from hypothesis import strategies as st
from read_back import read_back
from samples import PERIOD, START

from mount_recorder.automatic_marks import (
    BURST,
    REFILL,
    AutomaticMarks,
    AutomaticMarksError,
    FaultWatch,
    LostSampleWatch,
    MarkKind,
    SwitchOnWatch,
    mark_kinds,
)
from mount_recorder.bag_writer import BagWriter
from mount_recorder.diagnosis import OnFull, RecorderState, judge
from mount_recorder.recorder import Recorder
from mount_recorder.stamp_watch import StampWatch
from mount_recorder.watching import present_time, watch_topic
from mount_ros.messages.cdr import serialised
from mount_ros.messages.event import BY_HAND, Mark, mark_text, read_mark
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.messages.verdicts import verdicts_in
from mount_ros.nodes.diagnostics import Level
from mount_ros.topics import CONTROL_TRACE, DIAGNOSTICS


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def sent():
    return []


@pytest.fixture
def marks(sent, clock):
    return AutomaticMarks(sent.append, clock=clock)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.integers(-(2**63), 2**63), st.text(max_size=20), st.text(max_size=40))
def test_mark_survives_its_text(time, kind, text):
    mark = Mark(time, kind, text)
    assert read_mark(mark_text(mark), received=0) == mark


_WITH_LANE = '{time: 5, kind: pothole, text: deep, lane: 2}'
_DEEP = 'text: ' + '[' * 5000
# A list of lists of the one before: as text 10^9 words.
_BOMB = '\n'.join(
    ['a0: &a0 word', *(f'a{n}: &a{n} [{f"*a{n - 1}, " * 10}]' for n in range(1, 10)), 'text: *a9']
)


@pytest.mark.parametrize(
    ('text', 'mark'),
    [
        ('a pothole', Mark(7, BY_HAND, 'a pothole')),
        ('kind: pothole', Mark(7, 'pothole', '')),
        ('{time: 5, text: deep}', Mark(5, BY_HAND, 'deep')),
        ('{time: soon, kind: 3}', Mark(7, '3', '')),
        ('{unclosed', Mark(7, BY_HAND, '{unclosed')),
        ('', Mark(7, BY_HAND, '')),
        ('Driver: heavy bump', Mark(7, BY_HAND, 'Driver: heavy bump')),
        ('{time: 5, kind: pothole, text: deep, lane: 2}', Mark(5, 'pothole', _WITH_LANE)),
        ('2026-02-30', Mark(7, BY_HAND, '2026-02-30')),
        ('{time: 5, text: }', Mark(5, BY_HAND, '')),
        ('{time: true, text: 12:30}', Mark(7, BY_HAND, '12:30')),
        ('text: 2026-02-30', Mark(7, BY_HAND, '2026-02-30')),
        ('{time: 5, text: [deep, wet]}', Mark(5, BY_HAND, '{time: 5, text: [deep, wet]}')),
        (_DEEP, Mark(7, BY_HAND, _DEEP)),
        (_BOMB, Mark(7, BY_HAND, _BOMB)),
    ],
    ids=lambda value: f'{value}'[:30],
)
def test_anybody_may_publish_any_text(text, mark):
    assert read_mark(text, received=7) == mark


def test_present_time_is_that_of_the_stamps_in_lock_step():
    assert present_time(START, 5 * PERIOD) == 5 * PERIOD
    assert present_time(START, START - 10 * PERIOD) == START
    assert present_time(START, 0) == START


def test_switching_on_is_marked_each_time_and_switching_off_is_not(marks, sent):
    watch = SwitchOnWatch(marks)
    times = 1000, 1001, 1002, 1100
    for stamp, active in zip(times, (0.0, 1.0, 0.0, 1.0), strict=True):
        watch.add(stamp * PERIOD, active, 4.2e-4)
    told = 'damping on at 0.42 mm in the band'
    assert sent == [Mark(time * PERIOD, 'switch_on', told) for time in (1001, 1100)]


def test_of_several_mounts_the_one_is_named_that_damps(marks, sent):
    SwitchOnWatch(marks, 'left').add(1, 1.0, math.nan)
    assert sent == [Mark(1, 'switch_on', 'left: damping on')]


def test_an_opening_that_flutters_is_marked_once(marks, sent):
    time = np.arange(400)
    active = np.where(time % 30 < 15, 0.03, 0.0) * ((time > 100) & (time < 300))
    watch = SwitchOnWatch(marks)
    for stamp, value in zip(time.tolist(), active.tolist(), strict=True):
        watch.add(stamp * PERIOD, value, math.nan)
    assert [mark.time for mark in sent] == [101 * PERIOD]


def test_damping_that_goes_on_step_by_step_is_marked_once_and_needs_no_magnitude(marks, sent):
    watch = SwitchOnWatch(marks)
    for stamp, active in enumerate((0.0, 0.1, 0.7, 1.0, 0.4)):
        watch.add(stamp, active, math.nan)
    assert sent == [Mark(1, 'switch_on', 'damping on')]


def status(name, level, message=''):
    return DiagnosticStatus(name=name, level=bytes([level]), message=message)


def told(*values):
    (verdict,) = verdicts_in(DiagnosticArray(status=[status(*values)]))
    return verdict


def test_fault_is_marked_once_until_it_is_over(marks, sent):
    watch = FaultWatch(marks, '/')
    for time, level in enumerate((0, 1, 2, 2, 0, 2)):
        watch.add(time, told('mount_driver', level, f'silent for {time} s'))
    assert sent == [Mark(time, 'fault', f'mount_driver: silent for {time} s') for time in (2, 5)]


def test_faults_of_other_mounts_are_theirs(marks, sent):
    watch = FaultWatch(marks, '/mount_right')
    watch.add(0, told('mount_left/mount_driver', 2))
    watch.add(1, told('mount_right/mount_driver', 2))
    assert [mark.time for mark in sent] == [1]


def test_lost_samples_are_marked_where_the_stamps_go_on(marks, sent):
    watch = LostSampleWatch(marks, '/displacement', StampWatch(1000.0))
    for index in (0, 1, 2, 5, 6, 8):
        watch.add(START + index * PERIOD)
    assert sent == [
        Mark(START + 5 * PERIOD, 'lost_sample', '/displacement: 2 samples missing'),
        Mark(START + 8 * PERIOD, 'lost_sample', '/displacement: 1 sample missing'),
    ]


def test_broken_stream_does_not_flood(marks, sent, clock):
    watch = LostSampleWatch(marks, '/displacement', StampWatch(1000.0))
    for index in range(10_000):  # every second sample is missing, for 20 s
        clock.now = 2e-3 * index
        watch.add(START + 2 * index * PERIOD)
    assert BURST < len(sent) <= BURST + 20.0 / REFILL
    assert sent[BURST].text.endswith(f'{round(REFILL / 2e-3) - BURST} more since the mark before')


def test_kinds_have_rations_of_their_own(marks, sent):
    for _ in range(2 * BURST):
        marks.mark(MarkKind.LOST_SAMPLE, 0, '')
    marks.mark(MarkKind.FAULT, 0, '')
    assert sent[-1].kind == 'fault'
    assert marks.sent == len(sent) == BURST + 1


def test_kinds_that_are_not_wanted_are_not_marked(sent):
    marks = AutomaticMarks(sent.append, mark_kinds('fault, switch_on'))
    marks.mark(MarkKind.LOST_SAMPLE, 0, '')
    assert sent == []
    assert mark_kinds('') == ()


def test_unknown_kind_is_refused():
    with pytest.raises(AutomaticMarksError, match=r"some of switch_on, fault.*'fault earthquake'"):
        mark_kinds('fault earthquake')


def test_recorder_marks_from_the_messages_that_it_writes(tmp_path, marks, sent):
    recorder = Recorder(BagWriter(tmp_path / 'bag'))
    layout = ScalarsLayout(CONTROL_TRACE)
    active = CONTROL_TRACE.names.index('damping_active')
    receivers = {}
    for topic in (CONTROL_TRACE, DIAGNOSTICS):
        recorder._writer.add_topic(topic.name, topic.type)
        watch_topic(recorder, topic, topic.name, marks, '/', lambda: 77)
        receivers[topic] = recorder.receiver(topic.name)
    recorder.begin()
    for index, value in ((0, 0.0), (1, 1.0), (4, 1.0)):
        numbers = [0.0] * len(CONTROL_TRACE.names)
        numbers[active] = value
        receivers[CONTROL_TRACE](layout.pack(START + index * PERIOD, numbers), START, START)
    fault = DiagnosticArray(status=[status('mount_init', 2, 'no ripple')])
    receivers[DIAGNOSTICS](serialised(fault), START, START)
    recorder.end()
    assert [(mark.kind, mark.time) for mark in sent] == [
        ('switch_on', START + PERIOD),
        ('unanswered', START + 4 * PERIOD),
        ('fault', 77),
    ]


@pytest.mark.parametrize('threaded', [True, False])
@pytest.mark.parametrize(
    ('topic', 'malformed'),
    [(CONTROL_TRACE, b'\0\1\0\0' + bytes(13)), (CONTROL_TRACE, b''), (DIAGNOSTICS, b'\0\1\0\0\xff')],
)
def test_malformed_message_costs_its_observation_and_not_the_recording(
    tmp_path, marks, sent, topic, malformed, threaded
):
    recorder = Recorder(BagWriter(tmp_path / 'bag'), threaded=threaded)
    receivers = {}
    for each in (CONTROL_TRACE, DIAGNOSTICS):
        recorder._writer.add_topic(each.name, each.type)
        watch_topic(recorder, each, each.name, marks, '/', lambda: 77)
        receivers[each] = recorder.receiver(each.name)
    recorder.begin()
    numbers = [0.0] * len(CONTROL_TRACE.names)
    step = ScalarsLayout(CONTROL_TRACE).pack
    for index in range(4):
        receivers[CONTROL_TRACE](step(START + index * PERIOD, numbers), START, START)
        receivers[topic](malformed, START, START)
    receivers[CONTROL_TRACE](step(START + 5 * PERIOD, numbers), START, START)
    recorder.end()
    figures = recorder.figures()
    assert (figures.received, figures.kept, figures.lost, figures.failure) == (9, 9, 0, '')
    assert len(read_back(tmp_path / 'bag')) == 9
    assert [mark.kind for mark in sent] == ['unanswered']
    verdict = judge(RecorderState('/data/bag', figures, unobserved=recorder.unobserved), OnFull.STOP)
    assert verdict.level is Level.WARN
    assert f'{topic.name} 4 (the last of {len(malformed)} bytes' in verdict.sentence
    assert verdict.figures[f'malformed.{topic.name}'] == 4
