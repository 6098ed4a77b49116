"""What holds for every policy, the shipped ones and a new one in one file and one line."""

import math

import numpy as np
import pytest
import viscous_example
from controllers import TABLE_ROWS, sine

from mount_control.controller import ControlLaw, Controller
from mount_control.policy.contract import trace_fields
from mount_control.policy.registry import POLICIES
from mount_control.settings import control_settings, defaults, run_time_parameters
from mount_models.quantity import ParameterError, quantities
from mount_models.specimen import default_specimen

LENGTHS = ('m', 'm/s')
ALL = [*POLICIES, 'viscous_example']


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    """The one line in the registry."""
    monkeypatch.setitem(POLICIES, 'viscous_example', viscous_example)


@pytest.fixture
def make():
    """Return a function that builds a controller of some parameters."""

    def made(**values):
        settings = control_settings(values, default_specimen())
        return Controller(ControlLaw(settings, settings.table(*TABLE_ROWS)))

    return made


def test_a_policy_has_parameters_of_its_own_under_its_name():
    known = defaults()
    assert known['viscous_example.damping_coefficient'] == 1000.0
    assert known['policy'] == 'continuous_viscous'
    assert known['damper'] == 'viscous_2000'  # the first has no prefix
    assert {'viscous_example.damping_coefficient', 'damper', 'quality'} <= run_time_parameters()
    assert 'policy' not in run_time_parameters()


def test_a_parameter_out_of_range_is_refused_by_its_full_name():
    values = {'policy': 'viscous_example', 'viscous_example.damping_coefficient': -1.0}
    with pytest.raises(ParameterError, match=r'viscous_example\.damping_coefficient \(-1 N s/m\)'):
        control_settings(values, default_specimen())


@pytest.mark.parametrize('policy', ALL)
def test_a_trace_has_a_predicted_velocity_and_no_name_that_all_have(policy):
    own = POLICIES[policy].TRACE
    common = len(trace_fields(viscous_example)) - len(viscous_example.TRACE)
    assert 'predicted_velocity' in own
    assert len(trace_fields(POLICIES[policy])) == common + len(own) == 10 + len(own)


def test_the_example_makes_the_force_that_it_wants(make):
    traces = make(policy='viscous_example').run(sine(8.0, 1e-3, 1.0))
    np.testing.assert_array_equal(traces['desired_force'], 1000.0 * traces['predicted_velocity'])
    made = traces['normal_force'] * traces['friction_coefficient']
    within = traces['current'] < 2.9
    np.testing.assert_allclose(made[within], np.abs(traces['desired_force'][within]), rtol=1e-9)
    names = ('displacement', 'velocity', 'crank_frequency', 'predicted_velocity', 'damping_active')
    assert traces.dtype.names[:5] == names
    assert (traces['damping_active'] == 1.0).all()


@pytest.mark.parametrize('policy', ALL)
def test_every_number_of_a_policy_has_unit_meaning_and_range(policy):
    notes, parameters = quantities(POLICIES[policy].Parameters), POLICIES[policy].Parameters()
    numbers = {name: value for name, value in parameters._asdict().items() if not isinstance(value, str)}
    assert set(notes) == set(parameters._fields)
    assert all(notes[name].low <= value <= notes[name].high for name, value in numbers.items())


@pytest.mark.parametrize('policy', ALL)
def test_a_policy_begins_at_rest(make, policy):
    controller = make(policy=policy)
    controller.restart(0.003)
    trace = controller.run(np.full(1, 0.003))[0]
    own = [name for name, unit in POLICIES[policy].TRACE.items() if unit in LENGTHS]
    assert 'predicted_velocity' in own
    assert [trace[name] for name in (*own, 'velocity', 'bridged_samples')] == [0.0] * (len(own) + 2)


@pytest.mark.parametrize('policy', ALL)
def test_currents_keep_their_limits_and_off_is_0_ampere(make, policy):
    x = np.repeat(np.random.default_rng(7).uniform(-0.02, 0.02, 60), 40)
    traces = make(policy=policy, highest_current=1.5).run(x)
    on = traces['damping_active'] > 0.0
    assert (traces['damping_active'] <= 1.0).all()
    assert (traces['current'][~on] == 0.0).all()
    assert (traces['normal_force'][~on] == 0.0).all()
    assert (traces['current'][on] >= 0.4935).all()
    assert traces['current'].max() <= 1.5


@pytest.mark.parametrize('policy', ALL)
def test_whatever_of_the_memory_is_spoiled_it_begins_afresh_at_0_ampere(make, policy):
    controller = make(policy=policy)
    state = controller.memory.state.view(np.float64)
    counts = controller.memory.state.view(np.int64)
    for place in range(len(state)):
        controller.run(sine(8.0, 1e-3, 0.3))
        faults, kept = controller.faults, counts[place]
        state[place] = math.nan
        if place == len(state) - 1:  # the count of faults itself
            counts[place] = kept
            continue
        assert controller.step(0.0) == 0.0
        assert controller.faults == faults + 1
        assert np.isnan(controller.trace['predicted_velocity'])


@pytest.mark.parametrize('policy', ALL)
def test_a_change_of_parameters_lets_the_current_stand_for_a_sample(make, policy):
    controller, displacement = make(policy=policy), sine(8.0, 1e-3, 0.8)
    before = controller.run(displacement[:700])
    settings = control_settings({'policy': policy, 'damper': 'viscous_1000'}, default_specimen())
    controller.change(ControlLaw(settings, settings.table(*TABLE_ROWS)))
    after = controller.run(displacement[700:])
    assert after['current'][0] == pytest.approx(before['current'][-1], rel=1e-12)


def test_a_force_that_would_drive_is_no_force(make, monkeypatch):
    settings = control_settings({'policy': 'viscous_example'}, default_specimen())
    driving = settings.design._replace(law=settings.design.law._replace(damping_coefficient=-1000.0))
    settings = settings._replace(design=driving)
    traces = Controller(ControlLaw(settings, settings.table(*TABLE_ROWS))).run(sine(8.0, 1e-3, 0.3))
    assert traces['desired_force'].min() < -40.0
    assert (traces['normal_force'] == 0.0).all()
    assert (traces['current'] == settings.table(*TABLE_ROWS).limits.offset_current).all()
