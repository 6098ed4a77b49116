"""The controller's verdict on itself, worst first."""

from dataclasses import fields, replace
from types import SimpleNamespace

import pytest

from mount_control.control_loop import SampleCounts
from mount_control.diagnosis import ControlFigures, counted_since, verdict
from mount_ros.nodes.diagnostics import WINDOW, ActiveFindings, Level, SlidingWindow

GOOD = ControlFigures(
    lately=SampleCounts(),
    silence=0.001,
    longest_silence=0.020,
    step_median=80e-6,
    step_p99=210e-6,
    foreign_is_fatal=False,
    unread_reason='',
    values={'policy': 'switched_viscous', 'damper': 'viscous_2000', 'parameter_changes': 0},
)
OF_NODE = {field.name for field in fields(ControlFigures)}


def _verdict(**changes):
    """The verdict on a loop and a node at work, some of whose figures are changed."""
    of_loop = {name: value for name, value in changes.items() if name not in OF_NODE}
    of_node = {name: value for name, value in changes.items() if name in OF_NODE}
    loop = SimpleNamespace(
        counts=of_loop.pop('counts', SampleCounts(samples=10_000)),
        plausibility=SimpleNamespace(sentence=of_loop.pop('doubt', ''), held=of_loop.pop('doubted', False)),
        **{
            'refusal': '', 'damping_active': False, 'current': 0.0, 'last': 123_000_000, 'faults': 0,
            'last_fault': 0, 'foreign': '', 'writer_doubt': '', **of_loop,
        },
    )  # fmt: skip
    of_node.setdefault('lately', loop.counts)
    return verdict(loop, replace(GOOD, **of_node))


def _judged(**changes):
    judged = _verdict(**changes)
    return judged.level, judged.sentence


def test_an_outdated_table_is_an_error_with_its_reason():
    level, sentence = _judged(refusal='the measurements were interrupted', silence=9.0)
    assert (level, sentence) == (Level.ERROR, '0 A: the measurements were interrupted')


def test_silence_is_an_error_with_value_limit_and_remedy():
    assert _judged(silence=0.5, counts=SampleCounts(samples=10, invalid=3)) == (
        Level.ERROR,
        '0 A: no displacement for 0.50 s (limit 0.02 s); is mount_driver active and the electronics powered?',
    )
    assert _judged(silence=0.020)[0] is Level.OK


def test_invalid_samples_are_a_warning():
    level, sentence = _judged(counts=SampleCounts(samples=90, invalid=10, bridged=50))
    assert level is Level.WARN
    assert sentence.startswith(
        '10 of 100 displacement samples were invalid and answered with 0 A (limit: none in 10 s); check'
    )
    assert '50 of 90 samples were missing and bridged' in sentence


def test_a_displacement_in_doubt_is_an_error_while_that_lasts_and_a_warning_later():
    doubt, counts = 'displacement moved at 2.00 m/s (limit 1 m/s)', SampleCounts(samples=90, implausible=10)
    assert _judged(counts=counts, doubt=doubt, doubted=True) == (
        Level.ERROR,
        f'0 A until 1 s after the last doubt: {doubt}',
    )
    level, sentence = _judged(counts=counts, doubt=doubt)
    assert level is Level.WARN
    assert sentence.startswith('10 displacement samples were implausible and answered with 0 A')
    assert sentence.endswith(doubt)


@pytest.mark.parametrize(('bridged', 'level'), [(0, Level.OK), (10, Level.OK), (11, Level.WARN)])
def test_more_than_one_bridged_sample_in_a_thousand_is_a_warning(bridged, level):
    judged = _judged(counts=SampleCounts(samples=10_000, bridged=bridged))
    assert judged[0] is level
    if level is Level.WARN:
        assert judged[1].startswith('11 of 10000 samples were missing and bridged (limit 0.1 % of 10 s)')


def test_the_figures_hold_the_counts_and_the_last_stamp():
    counts = SampleCounts(samples=5, bridged=4, restarts=3, ignored=2, invalid=1)
    assert _verdict(counts=counts, current=1.23456).figures == {
        'samples': 5,
        'bridged': 4,
        'restarts': 3,
        'ignored': 2,
        'invalid': 1,
        'implausible': 0,
        'faults': 0,
        'last_fault': 0,
        'damping_active': False,
        'current_a': '1.2346',
        'step_median_us': '80',
        'step_p99_us': '210',
        'last_stamp': 123_000_000,
        'policy': 'switched_viscous',
        'damper': 'viscous_2000',
        'parameter_changes': 0,
        'needs_initialisation': False,
        'messages_malformed': 0,
        'fatal': False,
    }


def test_a_controller_that_was_spoiled_is_an_error_until_the_next_activation():
    judged = _verdict(faults=2, damping_active=True)
    assert judged.level is Level.ERROR
    assert judged.sentence.startswith('controller state became NaN or infinite: output 0 A, state reset')


@pytest.mark.parametrize('fatal', [True, False])
def test_another_writer_is_an_error_that_may_end_the_graph(fatal):
    foreign = '/evil must not publish displacement: end it'
    judged = _verdict(foreign=foreign, foreign_is_fatal=fatal)
    assert (judged.level, judged.figures['fatal']) == (Level.ERROR, fatal)
    assert judged.sentence == (
        '0 A: /evil must not publish displacement: end it, then activate mount_init and mount_control again'
    )


def test_a_writer_in_doubt_is_an_error_while_it_lasts():
    judged = _verdict(writer_doubt='two of them: end one')
    assert (judged.level, judged.figures['fatal']) == (Level.ERROR, False)
    assert judged.sentence == '0 A while this lasts: two of them: end one'


def test_messages_that_could_not_be_read_are_a_warning_with_the_reason():
    judged = _verdict(counts=SampleCounts(messages_malformed=2), unread_reason='cut')
    assert (judged.level, judged.figures['messages_malformed']) == (Level.WARN, 2)
    assert judged.sentence == (
        '2 messages could not be read and were not answered (limit: none in 10 s), the last for cut; which '
        'node publishes them?'
    )


@pytest.mark.parametrize('count', ['invalid', 'implausible', 'bridged', 'messages_malformed'])
def test_a_burst_is_warned_of_in_the_same_words_for_as_long_as_the_window_lasts(count):
    window, standing, told = SlidingWindow(SampleCounts()), ActiveFindings(), []
    for tenth in range(300):
        found = 100 * min(max(tenth - 49, 0), 5)
        counts = SampleCounts(samples=100 * tenth, **{count: found})
        lately = counted_since(window.earlier(tenth / 10, counts), counts)
        verdict_told = standing.keep(_verdict(counts=counts, lately=lately, doubt='step'))
        told.append((verdict_told.level, verdict_told.sentence))
    warned = [tenth for tenth, (level, _) in enumerate(told) if level is Level.WARN]
    assert (warned[0], len(warned)) == (50, warned[-1] - 49)
    assert 50 + 10 * WINDOW <= warned[-1] + 1 <= 54 + 10 * WINDOW
    assert len(set(told)) == 2
