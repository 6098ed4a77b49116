"""Pieces of a recording: nothing in them is changed."""

import numpy as np
import pytest
from compared_drives import START, answers, messages_of, write_answers

import engine_mount
from engine_mount.recordings.compare import compare
from engine_mount.recordings.edit import CutError, cut
from engine_mount.recordings.events import (
    EventError,
    event_time,
    find_event,
    recorded_events,
)
from engine_mount.recordings.metadata import origin
from mount_recorder.bag_writer import BagWriter

COUNT = 400
MARKS = ((50, '{time: 1, kind: fault, text: cable}'), (250, 'just a sentence'), (320, '{kind: fault}'))


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp('whole') / 'whole'
    return engine_mount.open(write_answers(folder, answers(COUNT), marks=MARKS))


def _messages(recording) -> dict[str, list[tuple[int, int, bytes]]]:
    found = messages_of(recording).items()
    return {name: sorted((log, publish, raw) for raw, log, publish in rows) for name, rows in found}


def _cut(recording, folder, *times, **options):
    cut(recording, folder, *times, **options)
    return engine_mount.open(folder)


def test_a_cut_has_the_messages_of_its_time_and_the_latched_ones_before(whole, place):
    piece = _cut(whole, place(), 0.1, 0.2, reason='fault')
    (step,) = origin(piece.information)
    told = [step[key] for key in ('did', 'recording', 'from_s', 'to_s', 'reason')]
    assert told == ['cut', 'whole', 0.1, 0.2, 'fault']
    original = _messages(whole)
    begin, end = START + 100_000_000, START + 200_000_000
    for name, rows in _messages(piece).items():
        inside = [row for row in original[name] if begin <= row[0] < end]
        latched = name in ('/session', '/air_gap', '/event')
        before = [row for row in original[name] if row[0] < begin][-1:] if latched else []
        assert rows == before + inside
    for name, topic in whole.topics.items():
        assert piece.topics[name].offered_qos == topic.offered_qos
    assert len(piece['displacement']) == 100
    assert piece['event'].message(0).data == MARKS[0][1]


@pytest.mark.parametrize(
    ('begin', 'end', 'why'),
    [
        (0.2, 0.1, 'would end at 0.100 s and begin at 0.200 s'),
        (None, -1.0, 'would end at'),
        (0.2, 0.2, 'would end at'),
        (9.0, None, 'ends at 0.399 s'),
        (float('nan'), None, 'must be numbers'),
        (0.10030, 0.10031, 'has no message from'),
    ],
)
def test_a_cut_of_nothing_is_refused(whole, place, begin, end, why):
    folder = place()
    with pytest.raises(CutError, match=why):
        cut(whole, folder, begin, end)
    assert not folder.exists()


# Events.


def test_events_are_marks_and_switchings_in_order(whole):
    events = recorded_events(whole)
    assert [event.kind for event in events] == ['fault', 'switch_on', 'mark', 'switch_off', 'fault']
    assert events[0].text == 'cable'
    assert events[2].text == 'just a sentence'
    assert np.diff([event.log_time for event in events]).min() > 0


@pytest.mark.parametrize(
    ('wanted', 'sample'),
    [('1', 50), ('2', 100), ('fault', 50), ('switch-on', 100), ('switch_off', 300)],
)
def test_an_event_is_found_by_number_kind_or_both(whole, wanted, sample):
    assert find_event(whole, wanted).log_time == START + sample * 1_000_000 + 200_000


@pytest.mark.parametrize('wanted', ['0', '6', 'rough', ''])
def test_an_event_that_is_not_there_is_refused_with_those_that_are(whole, wanted):
    with pytest.raises(EventError, match=r'1 fault at 0.050 s, 2 switch_on at 0.100 s'):
        find_event(whole, wanted)


# Time.


def _times(recording) -> dict[str, list[float]]:
    times: dict[str, list[float]] = {}
    for event in recorded_events(recording):
        times.setdefault(event.kind, []).append(round(event_time(event, recording.time_axis), 6))
    return times


def test_the_same_moment_has_the_same_time_among_events_in_a_cut_and_in_a_comparison(whole, place):
    """However long before the first sample the session came, and whenever the moment was received."""
    drive = engine_mount.open(write_answers(place(), answers(COUNT), marks=MARKS))
    writer = BagWriter(folder := place())
    for name, rows in _messages(drive).items():
        writer.add_topic(name, drive.topics[name].type)
        for log, _, payload in rows:
            writer.write(name, payload, log - 3_000_000_000 if name == '/session' else log + 5_000_000)
    writer.close()
    late = engine_mount.open(folder)
    assert _times(late) == _times(drive)
    assert _times(late) == {'fault': [0.05, 0.32], 'switch_on': [0.1], 'mark': [0.25], 'switch_off': [0.3]}
    with pytest.raises(EventError, match=r'1 fault at 0.050 s, 2 switch_on at 0.100 s'):
        find_event(late, 'rough')
    later = answers(COUNT, on=112)
    changes = compare(late, engine_mount.open(write_answers(place(), later))).switching_changes
    assert [(change.time_a, change.time_b) for change in changes] == [
        (pytest.approx(0.1), pytest.approx(0.112))
    ]
    piece = _cut(late, place(), 0.1, 0.3)
    assert _times(piece)['mark'] == [0.25]
    assert piece['displacement'].stamps[0] == START + 100_000_000
    assert len(piece['displacement']) == 200
