"""The judgement of a trial, from what was observed."""

import time
from functools import partial

import numpy as np
import pytest

from engine_mount.faults.case import MATRIX, FaultCase, Reaction
from engine_mount.faults.judge import Course, judge, reports_fault
from engine_mount.faults.observers import Observers, Report, Setpoint, Truth
from engine_mount.faults.page import write_page
from mount_ros.nodes.diagnostics import Level
from mount_sim.electronics.faults import FAULTS

SENTENCE = 'no frames for 100 ms (limit 20 ms); are the electronics powered?'
COURSE = Course(begun=10.0, cleared=10.6, damping_again=11.0, over=11.0)


def case(reaction, **options):
    return FaultCase('name', 'meaning', reaction, words='no frames', **options)


def observed(zero_at, until=10.6, reports=()):
    """What is seen of a graph that gives 1 A but for 0 A between two times (s)."""
    seen = Observers('')
    for at in np.arange(9.0, 11.0, 1e-3):
        off = zero_at is not None and zero_at <= at < until
        seen.setpoints.append(Setpoint(float(at), 0.0 if off else 1.0))
        seen.truths.append(Truth(float(at), 0.0 if off else 1.0, 0.0 if off else 1.0))
    seen.reports += reports
    return seen


def report(time, sentence=SENTENCE, level=Level.ERROR):
    return Report(time, 'mount_driver', level, sentence)


def test_a_safe_reaction_in_time_is_as_required():
    outcome = judge(case(Reaction.SAFE_WHILE, silent=True), COURSE, observed(10.025, reports=(report(10.1),)))
    assert outcome.ok
    assert (outcome.detected_by, outcome.sentence) == ('mount_driver', SENTENCE)
    assert outcome.zero_s == pytest.approx(0.025, abs=1e-3)
    assert outcome.detected_s == outcome.zero_s
    assert outcome.coil_current_a == 0.0
    assert outcome.recovered


@pytest.mark.parametrize(
    ('zero_at', 'until', 'sentences', 'wrong'),
    [
        (None, 0.0, (report(10.1),), '1.00 A at the end of the fault'),
        (10.02, 10.3, (report(10.1),), 'does not stay at 0 A'),
        (10.02, 10.6, (), 'nothing tells of it'),
        (10.02, 10.6, (report(10.1, 'no frames; look at the bus'),), 'no value'),
        (10.02, 10.6, (report(10.1, 'no frames for 100 ms'),), 'no remedy'),
        (10.09, 10.6, (report(10.2),), 'the limit is 50 ms'),
        (10.04, 10.6, (report(10.01),), 'after detection; the limit is 20 ms'),
    ],
)
def test_what_is_not_as_required_is_said(zero_at, until, sentences, wrong):
    outcome = judge(case(Reaction.SAFE_WHILE, silent=True), COURSE, observed(zero_at, until, sentences))
    assert not outcome.ok
    assert wrong in outcome.wrong


def test_a_coil_that_carries_current_though_none_is_wanted_is_said_where_the_graph_can_take_it_away():
    seen = observed(10.02, reports=(report(10.1),))
    seen.truths = [each._replace(coil_current=0.2) for each in seen.truths]
    wrong = judge(case(Reaction.SAFE_WHILE), COURSE, seen).wrong
    assert 'the coil carries 0.2 A at the end of the fault; the limit is 0.05 A' in wrong
    assert judge(case(Reaction.SAFE_WHILE, coil_apart=True), COURSE, seen).ok
    last = max(place for place, each in enumerate(seen.truths) if each.time < 10.6)
    seen.truths[last] = seen.truths[last]._replace(coil_current=0.0)  # the last that was seen counts
    assert judge(case(Reaction.SAFE_WHILE), COURSE, seen).ok
    seen.truths.clear()
    assert 'nobody has seen' in judge(case(Reaction.SAFE_WHILE), COURSE, seen).wrong


def test_a_fault_that_must_be_tolerated_may_not_switch_off_or_tell_an_error():
    assert judge(case(Reaction.TOLERATED), COURSE, observed(None)).ok
    assert 'damping should go on' in judge(case(Reaction.TOLERATED), COURSE, observed(10.1)).wrong
    wrong = judge(case(Reaction.TOLERATED), COURSE, observed(None, reports=(report(10.1),))).wrong
    assert 'mount_driver reports an error' in wrong


def test_a_drive_that_has_ended_has_not_recovered_and_may_only_where_that_is_required():
    course = Course(begun=10.0, over=11.0, ended=True)
    seen = observed(10.02, 11.0, (report(10.1),))
    assert judge(case(Reaction.SAFE_UNTIL_INITIALISED), course, seen).ok
    assert 'does not damp again' in judge(case(Reaction.SAFE_WHILE), course, seen).wrong


def test_damping_without_a_new_initialisation_where_one_is_required_is_said():
    seen = observed(10.02, reports=(report(10.1),))
    fault = case(Reaction.SAFE_UNTIL_INITIALISED)
    assert 'without a new initialisation' in judge(fault, COURSE, seen).wrong
    seen.initialisations.append(10.9)
    assert judge(fault, COURSE, seen).ok


def test_more_than_3_ampere_is_never_as_required():
    seen = observed(None)
    seen.setpoints.insert(1100, Setpoint(seen.setpoints[1100].time, 3.01))
    assert '3.01 A on the bus' in judge(case(Reaction.TOLD), COURSE, seen).wrong


def test_what_the_electronics_follow_counts_where_frames_do_not_reach_them():
    seen = observed(10.02, reports=(report(10.1),))
    seen.setpoints = [Setpoint(each.time, 1.0) for each in seen.setpoints]
    assert judge(case(Reaction.SAFE_WHILE, in_electronics=True), COURSE, seen).ok
    assert not judge(case(Reaction.SAFE_WHILE), COURSE, seen).ok


def test_a_trial_waits_for_the_end_of_what_would_pass_for_telling_of_its_fault():
    now, well = time.monotonic(), 'link to the electronics is up'
    picks = partial(reports_fault, case(Reaction.SAFE_WHILE))
    seen = observed(None, reports=(report(now - 1.5), report(now - 0.5, well, Level.OK)))
    assert seen.is_quiet(picks)
    seen.reports.append(Report(now - 0.2, 'mount_control', Level.WARN, SENTENCE))
    assert not seen.is_quiet(picks)
    seen.reports.append(Report(now - 0.1, 'mount_control', Level.WARN, 'something else (1, limit 0); look'))
    assert seen.is_quiet(picks)

    assert not observed(None, reports=(report(now - 60.0, 'well', Level.OK),)).is_quiet(lambda each: False)
    assert not observed(None, reports=(report(now - 0.5, 'anything', Level.WARN),)).is_quiet(
        lambda each: False
    )


def test_every_fault_of_the_electronics_is_in_the_matrix_and_every_reaction_in_its_third():
    tried = {name.removesuffix('_at_start') for name in MATRIX}
    assert set(FAULTS) <= tried
    third = [each for each in MATRIX.values() if each.third]
    assert {each.reaction for each in third} == set(Reaction)


def test_the_page_has_a_row_for_each_fault_and_says_what_is_wrong(tmp_path):
    sentence = 'no frames: 1 | 2; look (log: /home/me/runs/faults_12_3/log/mount_init.log)'
    good = judge(case(Reaction.TOLD), COURSE, observed(None, reports=(report(10.1, sentence),)))
    wrong = judge(case(Reaction.SAFE_WHILE), COURSE, observed(None))
    bad = FaultCase('other', 'meaning', Reaction.SAFE_WHILE)
    write_page({case(Reaction.TOLD): good, bad: wrong}, tmp_path / 'faults.md')
    page = (tmp_path / 'faults.md').read_text()
    assert '| `name` | meaning | mount_driver | 100 |' in page
    assert '1 \\| 2' in page
    assert '(log: bags/.../faults_12_3/log/mount_init.log)' in page  # not of the machine that wrote it
    assert 'NOT AS REQUIRED: nothing tells of it; the current does not stay at 0 A' in page
