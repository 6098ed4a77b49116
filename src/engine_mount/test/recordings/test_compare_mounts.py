"""Comparing recordings of several mounts: each by its own clock, under its own name."""

import pytest
from compared_drives import START, add_answers, answers

import engine_mount
from engine_mount.recordings.compare import compare
from engine_mount.recordings.events import recorded_events
from mount_recorder.bag_writer import BagWriter

COUNT = 400
SIGNALS = answers(COUNT)
LATER = START + 90_000_000_000


@pytest.fixture
def car(tmp_path):
    """Return a recording of the mounts `mount_left` and `mount_right`."""

    def written(name, left=SIGNALS, right=SIGNALS, start=START, phase=0, **options):
        writer = BagWriter(tmp_path / name)
        add_answers(writer, left, start=start, namespace='/mount_left')
        add_answers(writer, right, start=start + phase, namespace='/mount_right', **options)
        writer.close()
        return engine_mount.open(tmp_path / name)

    return written


@pytest.mark.parametrize('phase', [-600_000, -400_000, 400_000, 600_000])
def test_each_mount_is_aligned_by_its_own_first_sample(phase, car):
    """Their electronics sample at any time between the samples of the other."""
    comparison = compare(car('a'), car('b', start=LATER, phase=phase))
    assert comparison.equal, comparison.sentences()
    assert (
        'first samples of mount_right/displacement coincide' in comparison.figures()['alignment']['sentence']
    )


def test_switching_of_the_second_mount_is_told_with_its_name(car):
    comparison = compare(car('a'), car('b', right=answers(COUNT, on=112)))
    assert comparison.sentences()[0] == 'mount_right: switched on 12 ms later in B, at 0.112 s'
    told = comparison.figures()['switching']
    assert [(each['mount'], each['kind'], round(each['moved_ms'])) for each in told] == [
        ('mount_left', 'on', 0),
        ('mount_right', 'on', 12),
        ('mount_left', 'off', 0),
        ('mount_right', 'off', 0),
    ]


def test_sessions_and_marks_of_each_mount_are_compared(car):
    a = car('a', marks=((10, 'left behind'),))
    comparison = compare(a, car('b', session='scenario: sweep\n'))
    assert 'the sessions differ: mount_right: scenario is bench in A, sweep in B' in comparison.sentences()
    assert 'left behind' in [event.text for event in recorded_events(a)]
