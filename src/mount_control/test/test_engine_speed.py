"""Which speed of the engine a sample uses, and what is doubted."""

import math

import pytest

from mount_control.engine_speed import EngineSpeed

MS = 1_000_000  # ns
NOW = 10_000 * MS


def rad(turns: float) -> float:
    return 2.0 * math.pi * turns


def took(*messages):
    """The speed after messages (ms after NOW, Hz), each taken at its own time."""
    speed = EngineSpeed()
    for ms, turns in messages:
        speed.take(NOW + round(ms * MS), rad(turns), NOW + round(ms * MS))
    return speed


def at(speed, ms):
    return speed.at(NOW + round(ms * MS))


@pytest.mark.parametrize(
    ('ms', 'turns'),
    [(4.999, 0.0), (5.0, 13.0), (14.999, 13.0), (15.0, 14.0), (110.0, 14.0), (110.001, 0.0), (-20.0, 0.0)],
)
def test_a_sample_uses_the_newest_message_that_is_5_ms_to_0_1_s_older(ms, turns):
    assert at(took((0.0, 13.0), (10.0, 14.0)), ms) == pytest.approx(turns)


def test_a_message_that_arrives_4_ms_late_is_used_by_the_same_samples():
    speed, late = EngineSpeed(), EngineSpeed()
    for ms in range(200):
        for each, sent in ((speed, ms), (late, ms - 4)):
            if sent >= 0 and sent % 7 == 0:
                each.take(NOW + sent * MS, rad(20.0 + 0.01 * sent), NOW + ms * MS)
        assert at(late, ms) == at(speed, ms)
    assert late.doubted == 0


@pytest.mark.parametrize(
    ('messages', 'sentence'),
    [
        ([(20, math.nan)], 'nan turns a minute (limit 0 .. 9000): check engine_speed.signal'),
        ([(20, -1.0)], '-60 turns a minute'),
        ([(20, 150.1)], '9006 turns a minute'),
        ([(20, math.inf)], 'inf turns a minute'),
        ([(20, 30.0)], 'a change by +960 turns a minute in 0.010 s (limit 240)'),
        ([(10, 14.0)], 'its stamp does not rise'),
        ([(9, 14.0)], 'its stamp does not rise'),
    ],
)
def test_from_a_doubtful_message_on_the_speed_is_not_known(messages, sentence):
    speed = took((0, 14.0), (10, 14.0), *messages)
    assert at(speed, max(10, messages[-1][0]) + 5.5) == 0.0
    assert speed.doubted == 1
    assert speed.doubt.startswith(sentence)
    speed.take(NOW + 30 * MS, rad(14.0), NOW + 30 * MS)
    assert at(speed, 36) == pytest.approx(14.0)


@pytest.mark.parametrize('away', [0.101, -0.101])
def test_a_stamp_far_from_the_displacement_is_not_used_and_does_not_keep_out_what_follows(away):
    speed = took((0, 14.0))
    speed.take(NOW + round(away * 1e9), rad(14.0), NOW)
    assert speed.doubt.startswith(f'its stamp lies {away:+.3f} s from that of the displacement (limit 0.1 s)')
    speed.take(NOW + 10 * MS, rad(15.0), NOW + 10 * MS)
    assert at(speed, 16) == pytest.approx(15.0)


def test_an_engine_that_starts_and_stops_is_not_doubted():
    speed = took((0, 0.0), (10, 4.0), (20, 5.0), (30, 0.0))
    assert [at(speed, ms) for ms in (6, 16, 36)] == pytest.approx([0.0, 4.0, 0.0])
    assert speed.doubted == 0


def test_another_level_is_believed_once_an_engine_can_have_reached_it():
    speed, known = EngineSpeed(), []
    for ms in range(0, 120, 10):
        speed.take(NOW + ms * MS, rad(14.0 if ms < 30 else 30.0), NOW + ms * MS)
        known.append(at(speed, ms + 5))
    assert known == pytest.approx([14.0] * 3 + [0.0] * 6 + [30.0] * 3)  # 2 Hz and 200 Hz/s


def test_a_time_of_the_displacement_that_goes_back_begins_anew():
    speed = took((0, 14.0), (10, 14.0))
    for ms in range(1000, 1060, 10):
        speed.take(ms * MS, rad(40.0), ms * MS)
    assert speed.at(1056 * MS) == pytest.approx(40.0)
    assert speed.doubted == 0


def test_what_stopped_is_told_and_what_never_came_is_not():
    assert not EngineSpeed().stopped(NOW)
    speed = took((0, 14.0))
    assert not speed.stopped(NOW + 100 * MS)
    assert speed.stopped(NOW + 101 * MS)


def test_before_any_displacement_and_while_two_nodes_publish_nothing_is_used():
    speed = EngineSpeed()
    speed.take(NOW, rad(14.0), None)
    assert at(speed, 6) == 0.0
    speed = took((0, 14.0))
    speed.conflict = '/evil must not publish engine_speed too'
    assert at(speed, 6) == 0.0
    speed.conflict = ''
    assert at(speed, 6) == pytest.approx(14.0)
