"""Suites of manoeuvres: what is read, what is refused, and how figures are judged."""

import io
import json
import math
import re
from pathlib import Path
from unittest.mock import Mock

import pytest

from engine_mount.experiments.check import report, run
from engine_mount.experiments.check.run import CheckError, trials_of
from engine_mount.experiments.check.suite import (
    FAILED,
    MEASURES,
    NOT_JUDGED,
    PASSED,
    Result,
    SuiteError,
    chosen_of,
    passed,
    shipped_suite,
    suite_in_file,
    suite_of,
    verdicts_of,
    worst_first,
)
from engine_mount.recordings.screen import Screen
from mount_models.plain_yaml import plain_yaml

PAGE = Path(__file__).resolve().parents[4] / 'docs' / 'how-to' / 'check_a_change.md'
LIMIT = {'at_most': 0.7, 'source': 'chosen', 'reason': 'less is no use'}
ROAD = {'mount_sim.scenario': 'motorway', 'mount_sim.timeline.duration': 3}


def content(**changes):
    """A suite of two manoeuvres; `changes` are those of the second one."""
    road = {'about': 'A road.', 'set': dict(ROAD), 'limits': {'peak_over_undamped': dict(LIMIT)}}
    common = {'faults': {'at_most': 0, 'source': 'contract', 'reason': 'none is brought in'}}
    return {'limits': common, 'manoeuvres': {'first': road, 'second': {**road, **changes}}}


def refusal(given):
    with pytest.raises(SuiteError) as caught:
        suite_of(given)
    return str(caught.value)


def result(**figures):
    return Result({'peak_over_undamped': 0.5, 'faults': 0.0, **figures})


def trials(tmp_path, settings=None, suite=None):
    return trials_of(suite_of(suite or content()), settings or {}, tmp_path)


# What is read.


def test_the_shipped_suite_names_a_reason_and_a_source_for_every_limit_and_can_be_driven(tmp_path):
    suite = shipped_suite()
    assert {'gap_10mm', 'gap_20mm', 'gap_30mm', 'rough_road', 'sweep', 'idle', 'rack', 'tip_in'} <= {
        each.name for each in suite
    }
    assert all(limit.reason and limit.source for each in suite for limit in each.limits)
    assert len(trials_of(suite, {}, tmp_path)) == len(suite)


def test_a_limit_of_all_manoeuvres_is_one_of_each_on_which_it_can_be_told():
    given = content()
    given['limits']['rms_displacement_mm'] = dict(LIMIT)
    given['manoeuvres']['second']['set'] = {'mount_sim.scenario': 'bench'}
    given['manoeuvres']['second']['limits'] = {'switched_on': {**LIMIT, 'at_least': 0.5}}
    assert [[limit.measure for limit in each.limits] for each in suite_of(given)] == [
        ['peak_over_undamped', 'faults', 'rms_displacement_mm'],
        ['switched_on', 'switched_on', 'faults'],
    ]


def test_manoeuvres_are_chosen_by_name_in_the_order_of_the_suite():
    suite = suite_of(content())
    assert [each.name for each in chosen_of(suite, ['second', 'first'])] == ['first', 'second']
    with pytest.raises(SuiteError, match="'secnd' is no manoeuvre of the suite; did you mean second"):
        chosen_of(suite, ['secnd'])


@pytest.mark.parametrize(
    ('changes', 'sentence'),
    [
        ({'limit': {}}, "'limit' is no key of second; did you mean limits?"),
        ({'evaluated_from_s': '1 s'}, "second.evaluated_from_s must be a number; instead received '1 s'"),
        ({'evaluated_from_s': -1}, 'second.evaluated_from_s (-1 s) must be 0 or more'),
        ({'about': ''}, "second.about must be a text; instead received ''"),
        ({'limits': {'peak_over_undampd': LIMIT}}, "'peak_over_undampd' is no quantity of second"),
        ({'limits': {'faults': {**LIMIT, 'at_mots': 1}}}, "'at_mots' is no key of second.faults; did"),
        ({'limits': {'faults': {'source': 'paper', 'reason': 'x'}}}, 'second.faults must have at_most'),
        ({'limits': {'faults': {**LIMIT, 'source': 'guess'}}}, 'second.faults.source must be contract'),
        ({'limits': {'faults': {**LIMIT, 'at_most': math.nan}}}, 'second.faults.at_most must be a number'),
        ({'limits': {'distortion_percent': LIMIT}}, 'second: distortion_percent cannot be told on a road'),
        ({'set': {**ROAD, 'mount_sim.sed': 1}}, "second.set: 'sed' is no parameter of mount_sim; did"),
        ({'set': {**ROAD, 'mount_smi.seed': 1}}, "'mount_smi' is no node of second.set; did"),
        ({'set': {'mount_sim.seed': 1}}, 'second.set must have mount_sim.scenario'),
        ({'set': [1]}, 'second.set must be a mapping; instead received [1]'),
    ],
)  # fmt: skip
def test_what_a_suite_cannot_mean_is_refused_with_its_place(changes, sentence):
    assert refusal(content(**changes)).startswith(sentence)


def test_names_that_do_not_fit_the_table_and_suites_without_manoeuvres_are_refused():
    given = content()
    given['manoeuvres']['a_long_way_home'] = given['manoeuvres']['first']
    assert refusal(given) == 'a_long_way_home: a name has at most 10 characters, this one 15'
    assert refusal({'manoeuvres': {}}) == 'manoeuvres must name at least one manoeuvre'
    assert refusal(None).startswith('the suite must be a mapping with about, limits, manoeuvres')


def test_a_file_is_refused_with_its_name(tmp_path):
    file = tmp_path / 'ours.yaml'
    file.write_text('manoeuvres: {}\nmanoeuvres: {}\n', encoding='utf-8')
    with pytest.raises(SuiteError, match=r'ours\.yaml: is refused in line 2'):
        suite_in_file(file)
    with pytest.raises(SuiteError, match=r'none\.yaml: cannot be read'):
        suite_in_file(tmp_path / 'none.yaml')


# What is driven.


def test_settings_of_the_user_reach_every_manoeuvre(tmp_path):
    made = trials(tmp_path, {'mount_control': {'policy': 'switched_viscous'}})
    policies = [each.parameters['mount_control'] for each in made]
    assert policies == [{'policy': 'switched_viscous'}] * 2
    always = trials(tmp_path, {'mount_sim': {'mount': 'friction_always_on'}})[0].parameters
    assert always['mount_control']['switching'] == 'always'


@pytest.mark.parametrize(
    ('settings', 'begin', 'sentence'),
    [
        ({'mount_sim': {'scenario': 'sweep'}}, 0, 'mount_sim.scenario is set by the manoeuvre first itself'),
        ({'mount_sim': {'mounts': 'left,right'}}, 0, 'a suite checks one mount'),
        ({'mount_control': {'sample_rate': 2000.0}}, 0, 'a suite is judged at 1000 Hz'),
        ({'mount_control': {'policy': 'none'}}, 0, 'first: '),
        ({}, 3, 'second: evaluated_from_s (3 s) must lie before'),
    ],
)
def test_orders_that_no_manoeuvre_can_follow_are_refused_before_the_first(
    tmp_path, settings, begin, sentence
):
    with pytest.raises(CheckError) as caught:
        trials(tmp_path, settings, content(evaluated_from_s=begin))
    assert str(caught.value).startswith(sentence)
    assert not any(tmp_path.iterdir())


def test_a_manoeuvre_that_breaks_down_has_its_reason_and_no_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(run, 'drive', Mock(side_effect=ValueError('the plant has diverged')))
    assert run.run_trial(trials(tmp_path)[0]) == Result({}, broke_down='the plant has diverged')


def test_the_line_of_a_manoeuvre_is_its_worst_limit_with_its_remarks_below(tmp_path):
    name, quantity = 'gap_of_2mm', max(MEASURES, key=len)
    limit = {'at_most': 1234.0, 'source': 'chosen', 'reason': 'x'}
    given = {'manoeuvres': {name: {'about': 'A gap.', 'set': ROAD, 'limits': {quantity: limit}}}}
    given['manoeuvres']['free'] = {'about': 'A road.', 'set': ROAD}
    gap, free = trials(tmp_path, suite=given)
    shown = io.StringIO()
    report.show_result(gap, Result({quantity: 123456.0}, ('control began late',)), Screen(shown))
    report.show_result(free, result(), Screen(shown))
    failed_line, note, last = shown.getvalue().splitlines()
    assert failed_line.split() == ['fail', name, quantity, '123456', '≤', '1234', '-9905', '%']
    assert len(failed_line) <= 80
    assert note == f'{name} control began late'
    assert last.split() == ['free', 'no', 'limit']


# How it is judged.


def judged(limits=None, **figures):
    second = suite_of(content(**({'limits': limits} if limits else {})))[1]
    return {v.limit.measure: v.judged for v in verdicts_of(second, result(**figures))}


def test_a_limit_holds_up_to_its_value_and_what_is_not_known_fails():
    assert judged(peak_over_undamped=0.7)['peak_over_undamped'] is PASSED
    assert judged(peak_over_undamped=0.7001)['peak_over_undamped'] is FAILED
    assert judged(peak_over_undamped=math.nan)['peak_over_undamped'] is FAILED
    assert judged(faults=1.0)['faults'] is FAILED
    least = {'switched_on': {'at_least': 1, 'source': 'chosen', 'reason': 'x'}}
    assert judged(least, switched_on=0.0)['switched_on'] is FAILED
    assert judged(least, switched_on=1.0)['switched_on'] is PASSED
    broken = verdicts_of(suite_of(content())[0], Result({}, broke_down='no gap'))
    assert {verdict.judged for verdict in broken} == {NOT_JUDGED}
    assert not passed(broken)


def test_the_worst_stands_first_and_what_is_not_known_before_it():
    limits = {name: dict(LIMIT) for name in ('rms_over_undamped', 'ringing_s', 'pad_energy_j', 'switched_on')}
    manoeuvre = suite_of(content(limits=limits))[1]
    figures = result(rms_over_undamped=0.1, ringing_s=9.0, pad_energy_j=math.nan, switched_on=0.6)
    ordered = [v.limit.measure for v in worst_first(verdicts_of(manoeuvre, figures))]
    assert ordered == ['pad_energy_j', 'ringing_s', 'switched_on', 'rms_over_undamped', 'faults']


def checked(tmp_path, second):
    made, results = trials(tmp_path), {'first': result(), 'second': second}
    return made, results, report.all_verdicts(made, results)


def test_a_common_limit_that_holds_everywhere_stands_once_and_one_that_fails_by_its_manoeuvre(tmp_path):
    rows = [row[:3] for row in report.table_of(*checked(tmp_path, result())[1:]).rows]
    assert rows == [
        ('ok', 'first', 'peak_over_undamped'),
        ('ok', 'second', 'peak_over_undamped'),
        ('ok', 'all 2', 'faults'),
    ]
    table = report.table_of(*checked(tmp_path, result(faults=2.0))[1:])
    assert table.rows[0][:4] == ('fail', 'second', 'faults', '2')
    assert table.marked == {0}
    assert table.caption == '1 of 2 manoeuvres within their 4 limits; not second.'


def test_a_manoeuvre_that_broke_down_is_one_row_with_its_reason_and_how_much_is_not_judged(tmp_path):
    made, results, verdicts = checked(tmp_path, Result({}, broke_down='the plant has diverged'))
    table = report.table_of(results, verdicts)
    assert table.rows[0] == (
        'fail', 'second', 'broke down: the plant has diverged; not judged: 2 limits', '', '', '',
    )  # fmt: skip
    assert [row[1] for row in table.rows] == ['second', 'first', 'first']
    assert table.marked == {0}
    assert table.caption == '1 of 2 manoeuvres within their 2 limits; not second.'
    figures = report.figures_of(made, {}, results, verdicts)
    assert not figures['passed']
    second = figures['manoeuvres']['second']
    assert second['broke_down'] == 'the plant has diverged'
    assert [each['verdict'] for each in second['verdicts']] == ['not judged'] * 2


def test_figures_are_plain_json_with_null_for_what_is_not_known(tmp_path):
    made, results, verdicts = checked(tmp_path, result(rms_over_undamped=math.nan))
    figures = json.loads(json.dumps(report.figures_of(made, {}, results, verdicts), allow_nan=False))
    assert figures['passed'] is True
    assert figures['manoeuvres']['second']['figures']['rms_over_undamped'] is None
    assert figures['manoeuvres']['first']['verdicts'][0] == {
        'quantity': 'peak_over_undamped',
        'value': 0.5,
        'at_most': 0.7,
        'verdict': 'ok',
        'left': pytest.approx(2 / 7),
        'source': 'chosen',
        'reason': 'less is no use',
    }


def test_the_suite_of_the_page_can_be_used_and_the_page_names_every_quantity():
    text = PAGE.read_text(encoding='utf-8')
    (block,) = re.findall(r'```yaml\n(.*?)```', text, re.DOTALL)
    assert [each.name for each in suite_of(plain_yaml(block))] == ['deep_gap']
    assert [name for name in MEASURES if f'`{name}`' not in text] == []
