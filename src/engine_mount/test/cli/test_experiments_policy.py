"""The comparison of policies on a short version, and the estimates and bounds that it states."""

import json

import numpy as np
import pytest

from engine_mount.experiments import bound, policy, policy_cases
from engine_mount.experiments.harness import measures
from engine_mount.experiments.harness.closed_loop import at_each_step, truth_of_run
from engine_mount.experiments.harness.experiment import Holds
from engine_mount.experiments.policy_cases import CONTINUOUS, POLICIES
from engine_mount.experiments.registry import experiment
from mount_models.quantity import ParameterError, with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.parameters import SimParameters

SHORT = {
    'road_levels': '0.06,',
    'last_frequency': 16.0,
    'gap_depths': '0.02,',
    'gap_seeds': 1,
    'rack_frequencies': '8,',
    'thorough': 0,
    'bound': 0,
    'workers': 1,
}


@pytest.fixture(scope='module')
def compared(tmp_path_factory):
    folder = tmp_path_factory.mktemp('policy')
    return experiment(policy.NAME, out=folder, **SHORT)


@pytest.mark.slow
def test_continuous_law_is_below_the_hydromount_where_the_paper_policy_is_not(compared):
    figures = json.loads(json.dumps(compared.figures, allow_nan=False))
    assert all(set(POLICIES) <= set(figures[key]) for key in ('sweep_ratio', 'gap_peak_ratio', 'thd'))
    swept, paper = (figures['sweep_ratio'][name]['0.06'] for name in (CONTINUOUS, POLICIES[0]))
    assert swept < 0.6 < 1.0 < paper
    (peak,) = figures['gap_peak_ratio'][CONTINUOUS]['20']
    assert peak < 0.87
    assert figures['gap_first_extremum_ratio'][CONTINUOUS]['20'][0] < 1.05
    assert figures['thd'][CONTINUOUS]['8'] < 1.0


def test_page_and_pictures_are_written_from_the_numbers(compared):
    (page,) = compared.pages
    text = page.read_text(encoding='utf-8')
    assert f'{compared.figures["sweep_ratio"][CONTINUOUS]["0.06"]:.2f}' in text
    assert all(f'figures/{picture.name}' in text for picture in compared.pictures)
    assert [compared.claims[0].holds, compared.claims[0].ours.holds] == [Holds.NO, Holds.YES]


def test_the_plant_that_its_setpoints_drive_again_goes_the_way_of_the_run():
    values = {'timeline.start': 2.9, 'timeline.duration': 0.7, 'motorway.gap_time': 0.3}
    truth = truth_of_run({'mount_sim': values, 'mount_control': {}})
    sim = with_flattened(SimParameters(), values)
    again = at_each_step(truth.current_setpoint, sim)['chassis_acceleration']
    np.testing.assert_array_equal(again[::20], truth.chassis_acceleration[:-1])
    straight = at_each_step(truth.current_setpoint, sim, straight=True)
    assert not np.array_equal(straight['chassis_acceleration'], again)


@pytest.mark.parametrize('text', ['fast', '0.1, 0.1', '0.1, 3'])
def test_a_list_that_is_no_list_of_levels_is_refused(text, tmp_path):
    with pytest.raises(ParameterError, match=r'policy\.road_levels'):
        experiment(policy.NAME, out=tmp_path, road_levels=text)


@pytest.fixture(scope='module')
def short_window():
    values = {'timeline.duration': 0.4, 'motorway.gap_time': 0.1, 'idle.amplitude': 100.0}
    sim = with_flattened(SimParameters(), values)
    return bound.Window(sim, 0.5, {'displacement': 1e-7, 'acceleration': 1e-2})


def test_linear_car_goes_the_way_of_the_simulation(short_window):
    short_window.cost(np.zeros(short_window.samples))
    mean_squares, displacement = short_window.damped(0.0)
    np.testing.assert_allclose(
        short_window.rows[20::20, bound._DISPLACEMENT], displacement, rtol=1e-9, atol=1e-15
    )
    assert mean_squares['displacement'] > 1e-9


def test_gradient_of_the_best_force_is_that_of_finite_differences(short_window):
    levels = 60.0 * np.random.default_rng(2).random(short_window.samples)
    _, gradient = short_window.cost(levels)
    for sample in (50, 200, 390):
        step = np.zeros_like(levels)
        step[sample] = 1e-2
        (above, _), (below, _) = (short_window.cost(levels + each) for each in (step, -step))
        assert gradient[sample] == pytest.approx((above - below) / 2e-2, rel=1e-4)


@pytest.mark.slow
def test_best_force_is_far_better_than_the_ideal_dampers():
    values = policy_cases.windows(200.0)['idle, class A'] | {
        'mount': 'friction_off',
        'timeline.duration': 1.0,
    }
    truth = truth_of_run({'mount_sim': values, 'mount_control': {}})
    sim = with_flattened(SimParameters(), values)
    without = bound.of_ideal(truth, sim)

    def cost(figures):
        return np.mean([figures[name] / without[name] for name in bound.MEASURES])

    found = bound.best(0.5, truth, sim)
    assert cost(found) < 0.7 * min(map(cost, without['ideal'].values()))
    assert cost(found) < cost(found['late'])


@pytest.mark.slow
def test_knowledge_of_the_road_ahead_is_worth_much():
    values = policy_cases.windows(0.0)['class A'] | {'mount': 'friction_off', 'timeline.duration': 1.5}
    truth = truth_of_run({'mount_sim': values, 'mount_control': {}})
    sim = with_flattened(SimParameters(), values)
    known, unknown = (bound.foreseen(preview, truth, sim) for preview in (40, 2))
    assert known['acceleration'] < 0.3 * unknown['acceleration']


def test_first_extremum_is_the_first_clear_turning_point():
    time = SAMPLE_TIME * np.arange(1000)
    ringing = 0.02e-3 * np.sin(2.0 * np.pi * 90.0 * time) * (time < 0.02)
    ringing += np.where(time > 0.03, 1e-3 * np.sin(2.0 * np.pi * 8.0 * (time - 0.03)), 0.0)
    assert measures.first_extremum(ringing) == pytest.approx(1e-3, rel=0.01)
