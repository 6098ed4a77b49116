"""Findings are told in the words in which they were found; counts are those of a sliding window."""

import random

import pytest

from mount_ros.messages.verdicts import Flags, flags_of
from mount_ros.nodes.diagnostics import (
    WINDOW,
    ActiveFindings,
    Finding,
    Level,
    SlidingWindow,
    verdict_on,
)

LOOK = 0.1  # s


def loss(count):
    return Finding(Level.WARN, 'loss', f'{count} lost; check the bus')


@pytest.mark.parametrize('seed', range(20))
def test_a_burst_counts_for_as_long_as_the_window_lasts_and_is_told_in_the_same_words(seed):
    rng = random.Random(seed)
    begin, length = rng.randrange(1, 300), rng.randrange(1, 50)
    window, standing, counted, told = SlidingWindow(0), ActiveFindings(), 0, []
    for look in range(600):
        counted += rng.randrange(1, 9) if begin <= look < begin + length else 0
        lately = counted - window.earlier(look * LOOK, counted)
        verdict = standing.keep(verdict_on([loss(lately)] if lately else [], 'well', {'lost': counted}))
        told.append((verdict.level, verdict.sentence))
        assert verdict.figures['lost'] == counted
    warned = [look for look, (level, _) in enumerate(told) if level is Level.WARN]
    last = round(WINDOW / LOOK) + begin + length - 1
    assert begin == warned[0]
    assert abs(warned[-1] + 1 - last) <= 1  # of the window's end a rounding may decide
    assert warned == list(range(warned[0], warned[-1] + 1))
    assert len({told[look] for look in warned}) == 1
    assert told[-1] == (Level.OK, 'well')


def test_a_graver_level_is_told_at_once_and_the_first_error_speaks_alone():
    hot, hotter = Finding(Level.WARN, 'hot', '120 degC'), Finding(Level.ERROR, 'hot', '150 degC')
    standing = ActiveFindings()
    assert standing.keep(verdict_on([hot, loss(1)], 'well', {})).sentence == '120 degC. 1 lost; check the bus'
    silent = Finding(Level.ERROR, 'silence', 'no frames')
    verdict = standing.keep(verdict_on([hotter, silent, loss(2)], 'well', {}))
    assert (verdict.level, verdict.sentence) == (Level.ERROR, '150 degC')


def test_flags_are_what_a_node_has_published_as_true():
    assert flags_of({'fatal': 'True', 'held': 'False', 'samples': '1'}) == Flags(fatal=True)
    assert flags_of({}) == Flags()
