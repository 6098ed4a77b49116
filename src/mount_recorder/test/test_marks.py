"""Marks: their text, and those that the recorder sets by itself."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hypothesis import given, settings
from hypothesis import strategies as st
from read_back import read_back
from ros_testing import serialised
from samples import PERIOD, START

from mount_models.quantity import ParameterError
from mount_recorder.automatic_marks import BURST, REFILL, AutomaticMarks, MarkKind, mark_kinds
from mount_recorder.recorder import Recorder
from mount_recorder.stamp_watch import StampWatch
from mount_recorder.watching import FaultWatch, SwitchWatch
from mount_ros.messages.event import BY_HAND, Mark, mark_text, read_mark
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CONTROL_TRACE, DIAGNOSTICS, control_trace


class Clock:
    now = 0.0

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
        ('{time: soon, kind: 3}', Mark(7, '3', '')),
        ('{unclosed', Mark(7, BY_HAND, '{unclosed')),
        ('', Mark(7, BY_HAND, '')),
        ('Driver: heavy bump', Mark(7, BY_HAND, 'Driver: heavy bump')),
        (_WITH_LANE, Mark(5, 'pothole', _WITH_LANE)),
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


def step(stamp, active, magnitude=math.nan):
    values = dict.fromkeys(CONTROL_TRACE.names, 0.0) | {'damping_active': active, 'magnitude': magnitude}
    return ScalarsLayout(control_trace(tuple(values))).pack(stamp, list(values.values()))


def observe_steps(marks, steps, mount=''):
    """Return a watch of `control_trace` that has seen {index: damping_active}."""
    watch = SwitchWatch(marks, StampWatch(1000.0), mount)
    for index, active in steps.items():
        watch.observe(step(START + index * PERIOD, active, 4.2e-4 if active == 1.0 else math.nan))
    return watch


@pytest.mark.parametrize(
    ('steps', 'begins', 'off'),
    [
        ({0: 0.0, 1: 1.0, 2: 0.0} | dict.fromkeys(range(3, 100), 0.0) | {100: 1.0}, (1, 100), 2),
        # An opening that flutters, with pauses shorter than 40 ms, is one.
        ({time: 0.03 if time % 30 < 15 and 100 < time < 300 else 0.0 for time in range(400)}, (101,), 285),
        (dict(enumerate((0.0, 0.1, 0.7, 1.0, 0.4))), (1,), None),
    ],
)
def test_switching_on_is_marked_each_time_and_switching_off_is_reported(marks, sent, steps, begins, off):
    assert observe_steps(marks, steps).off == (0 if off is None else START + off * PERIOD)
    assert [(mark.time, mark.kind) for mark in sent] == [
        (START + begin * PERIOD, 'switch_on') for begin in begins
    ]
    assert sent[0].text == ('damping on at 0.42 mm in the band' if steps[begins[0]] == 1.0 else 'damping on')


def test_of_several_mounts_the_one_is_named_that_damps(marks, sent):
    observe_steps(marks, {0: 0.5}, mount='left')
    assert sent == [Mark(START, 'switch_on', 'left: damping on')]


def report(name, level, message=''):
    return serialised(
        DiagnosticArray(status=[DiagnosticStatus(name=name, level=bytes([level]), message=message)])
    )


def test_fault_is_marked_once_until_it_is_over_and_only_that_of_the_own_mount(marks, sent):
    clock = iter(range(10))
    watch = FaultWatch(marks, '/mount_right', lambda: next(clock))
    for index, level in enumerate((0, 1, 2, 2, 0, 2)):
        watch.observe(report('mount_right/mount_driver', level, f'silent for {index} s'))
        watch.observe(report('mount_left/mount_driver', 2))
    assert sent == [
        Mark(time, 'fault', f'mount_right/mount_driver: silent for {index} s')
        for time, index in enumerate((2, 5))
    ]


def test_broken_stream_does_not_flood_and_kinds_have_rations_of_their_own(marks, sent, clock):
    for index in range(10_000):
        clock.now = 2e-3 * index  # for 20 s
        marks.mark(MarkKind.SWITCH_ON, 0, 'gap')
    assert BURST < len(sent) <= BURST + 20.0 / REFILL
    assert sent[BURST].text == 'gap; 991 more since the mark before'
    marks.mark(MarkKind.FAULT, 0, '')
    assert sent[-1].kind == 'fault'
    assert marks.sent == len(sent)


def test_kinds_that_are_not_wanted_are_not_marked_and_unknown_ones_are_refused(sent):
    AutomaticMarks(sent.append, mark_kinds('fault, recording_loss')).mark(MarkKind.SWITCH_ON, 0, '')
    assert sent == []
    assert mark_kinds('') == ()
    with pytest.raises(ParameterError, match=r"some of switch_on, fault.*'fault earthquake'"):
        mark_kinds('fault earthquake')


@pytest.mark.parametrize(
    ('topic', 'malformed'),
    [(CONTROL_TRACE, b'\0\1\0\0' + bytes(13)), (CONTROL_TRACE, b''), (DIAGNOSTICS, b'\0\1\0\0\xff')],
)
def test_malformed_message_costs_its_observation_and_not_the_recording(
    tmp_path, marks, sent, topic, malformed
):
    recorder = Recorder(tmp_path / 'bag')
    receivers = {entry: recorder.add_topic(entry.name, entry.type) for entry in (CONTROL_TRACE, DIAGNOSTICS)}
    watch = recorder.watches[CONTROL_TRACE.name] = StampWatch(1000.0)
    recorder.observers[CONTROL_TRACE.name] = SwitchWatch(marks, watch).observe
    recorder.observers[DIAGNOSTICS.name] = FaultWatch(marks, '/', lambda: 77).observe
    recorder.begin()
    for index in range(4):
        receivers[CONTROL_TRACE](step(START + index * PERIOD, 0.0), START, START)
        receivers[topic](malformed, START, START)
    receivers[CONTROL_TRACE](step(START + 5 * PERIOD, 0.0), START, START)
    receivers[DIAGNOSTICS](report('mount_init', 2, 'no ripple'), START, START)
    recorder.end()
    figures = recorder.figures()
    assert (figures['received'], figures['kept'], figures['lost'], recorder.failure) == (10, 10, 0, '')
    assert len(read_back(tmp_path / 'bag')) == 10
    assert [mark.kind for mark in sent] == ['fault']
    assert watch.lost == 1
    assert recorder.figures_by_topic()[f'malformed.{topic.name}'] == 4
    assert f'{len(malformed)} bytes; ' in recorder.unobserved[topic.name].last
