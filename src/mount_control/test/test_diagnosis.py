"""The controller's verdict on itself, worst first."""

from types import SimpleNamespace

import pytest
from bursts import check_burst

from mount_control.control_loop import SampleCounts
from mount_control.diagnosis import counted_since, verdict
from mount_control.engine_speed import EngineSpeed
from mount_ros.nodes.diagnostics import Level, SlidingWindow

DOUBT = 'displacement moved at 2.00 m/s (limit 1 m/s)'
BURST = SampleCounts(samples=90, invalid=10, implausible=10, bridged=50)


def judged(counts=None, lately=None, silence=0.0, doubt='', held=False, doubted=0, speed=None, **changes):
    """The verdict on a loop at work, some of whose figures are changed."""
    counts = counts or SampleCounts(samples=10_000)
    loop = SimpleNamespace(
        counts=counts,
        plausibility=SimpleNamespace(sentence=doubt, held=held),
        engine_speed=speed or EngineSpeed(),
        **{
            'refusal': '', 'damping_active': False, 'current': 0.0, 'last': 123_000_000, 'faults': 0,
            'foreign': '', 'writer_doubt': '', **changes,
        },
    )  # fmt: skip
    return verdict(loop, lately or counts, doubted, silence, 0.020, {'policy': 'switched_viscous'})


ERRORS = {
    'foreign': '0 A: /evil: end it, then activate mount_init and mount_control again',
    'refusal': '0 A: the measurements were interrupted',
    'writer_doubt': '0 A while this lasts: two of them: end one',
    'silence': '0 A: no displacement for 0.50 s (limit 0.02 s); is mount_driver active and the electronics '
    'powered?',
    'faults': 'controller state became NaN or infinite: output 0 A, state reset; set friction.* and '
    'contact.* of mount_control closer to their defaults',
    'held': f'0 A until 1 s after the last doubt: {DOUBT}',
}
CAUSES = {
    'foreign': '/evil: end it',
    'refusal': 'the measurements were interrupted',
    'writer_doubt': 'two of them: end one',
    'silence': 0.5,
    'faults': 2,
    'held': True,
}


@pytest.mark.parametrize('first', range(len(ERRORS)))
def test_of_errors_the_gravest_is_told_with_value_limit_and_remedy(first):
    causes = dict(list(CAUSES.items())[first:])
    found = judged(BURST, doubt=DOUBT, **causes)
    assert (found.level, found.sentence) == (Level.ERROR, list(ERRORS.values())[first])
    assert found.figures['needs_initialisation'] == ('refusal' in causes)


def test_of_warnings_none_hides_another():
    found = judged(BURST, doubt=DOUBT)
    assert found.level is Level.WARN
    assert found.sentence == (
        '10 displacement samples were implausible and answered with 0 A (limit: none in 10 s); first of the '
        f'last ones: {DOUBT}. 10 of 100 displacement samples were invalid and answered with 0 A (limit: none '
        'in 10 s); check the displacement sensor. 50 of 90 samples were missing and bridged (limit 0.1 % of '
        "10 s); look at mount_driver's counts of lost frames"
    )


@pytest.mark.parametrize(('bridged', 'level'), [(0, Level.OK), (10, Level.OK), (11, Level.WARN)])
def test_more_than_one_bridged_sample_in_a_thousand_is_a_warning(bridged, level):
    assert judged(SampleCounts(samples=10_000, bridged=bridged), silence=0.020).level is level


def test_the_figures_hold_the_counts_and_the_last_stamp():
    counts = SampleCounts(samples=5, bridged=4, restarts=3, ignored=2, invalid=1)
    assert judged(counts, current=1.23456).figures == {
        'samples': 5, 'bridged': 4, 'restarts': 3, 'ignored': 2, 'invalid': 1, 'implausible': 0, 'faults': 0,
        'damping_active': False, 'current_a': '1.2346', 'last_stamp': 123_000_000,
        'needs_initialisation': False, 'policy': 'switched_viscous',
    }  # fmt: skip


@pytest.mark.parametrize('count', ['invalid', 'implausible', 'bridged'])
def test_a_burst_is_warned_of_in_the_same_words_for_as_long_as_the_window_lasts(count):
    window = SlidingWindow(SampleCounts())

    def judge(time, samples, found):
        counts = SampleCounts(samples=samples, **{count: found})
        return judged(counts, counted_since(window.earlier(time, counts), counts), doubt='step')

    check_burst(judge)


def test_a_speed_of_the_engine_that_is_doubted_or_stopped_is_a_warning_and_none_is_nothing():
    assert judged().level is Level.OK
    speed = EngineSpeed()
    speed.take(1_000_000, 1e9, 1_000_000)
    found = judged(doubted=1, speed=speed)
    assert found.level is Level.WARN
    assert 'none for more than 0.1 s; look at mount_driver' in found.sentence
    assert 'in 1 messages (limit: none in 10 s); the last: 9549296586 turns a minute' in found.sentence
