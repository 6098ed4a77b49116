"""The control law as a whole: a displacement goes in, a current comes out."""

import math

import numpy as np
import pytest
from controllers import TABLE_ROWS, make_controller, make_law, make_settings, sine
from hypothesis import given
from hypothesis import settings as hypothesis
from hypothesis import strategies as st

from mount_control.controller import FARTHEST_DISPLACEMENT, ControlLaw, Controller, compiled_with
from mount_control.force_maker import FADE_TIME
from mount_control.policy import switched_viscous
from mount_control.policy.contract import trace_fields
from mount_control.policy.registry import POLICIES
from mount_models.damper import damper_curve
from mount_models.friction.coefficient import FrictionCoefficients, dynamic_coefficient
from mount_models.friction.simplified import fade_weight
from mount_ros import topics

PAPER = compiled_with(switched_viscous)
SHAKING = st.lists(st.floats(-0.02, 0.02), min_size=1, max_size=12)


def _held(values, length=60):
    """A signal that stays at each value for some samples."""
    return np.repeat(np.array(values), length)


def _equal(one, other):
    return one.tobytes() == other.tobytes()


def test_traces_have_the_names_and_units_of_their_topic():
    scalars = (*topics.CONTROL_TRACE.scalars, *topics.CONTROL_TRACE.optional)
    traced = {name: unit for policy in POLICIES.values() for name, unit in trace_fields(policy).items()}
    assert traced == {scalar.name: scalar.unit for scalar in scalars}
    assert {PAPER.trace[name] for name in PAPER.trace.names} == {np.dtype('f8')}


@pytest.mark.parametrize('spoiled', [False, True])
def test_single_steps_equal_a_run_to_the_bit(spoiled):
    displacement = sine(8.0, 1.3e-3, 0.7) + sine(21.0, 0.2e-3, 0.7)
    displacement[400] = math.nan
    single, whole = make_controller(), make_controller()
    for controller in (single, whole) if spoiled else ():
        currents = controller.memory.tables.current
        currents[len(currents) // 4 :] = math.nan  # met within the run, again and again
    frequencies = np.linspace(-5.0, 50.0, len(displacement))
    frequencies[[200, 300]] = math.nan, math.inf
    traces = whole.run(displacement, crank_frequency=frequencies)
    assert (whole.faults > 0) == spoiled
    for number, x in enumerate(displacement):
        current = single.step(x, crank_frequency=frequencies[number])
        assert current == traces['current'][number]
        assert single.trace_record.tobytes() == traces[number].tobytes()
    known = (frequencies > 0.0) & (frequencies < math.inf)
    np.testing.assert_array_equal(traces['crank_frequency'], np.where(known, frequencies, 0.0))


def test_the_desired_force_is_the_damper_s_at_the_predicted_velocity():
    traces = make_controller().run(sine(8.0, 1e-3, 1.0))
    on = traces[traces['damping_active'] == 1]
    velocity = on['predicted_velocity']
    expected = np.sign(velocity) * 2000.0 * np.maximum(np.abs(velocity) - 0.004, 0.0)
    np.testing.assert_allclose(on['desired_force'], expected, atol=1e-9)
    assert (on['desired_force'] == 0.0).any()  # the dead zone is in use


def test_the_coefficient_is_the_friction_law_s_at_this_velocity_and_force():
    traces = make_controller().run(sine(8.0, 1e-3, 1.0))
    for place in range(500, 1000, 7):
        now, velocity = traces[place], traces['predicted_velocity'][place]
        if abs(velocity) < 0.006:
            continue  # below 4 N the floor of the coefficient may act
        deflection = np.sign(velocity) * traces['friction_deflection'][place - 1]
        mu = dynamic_coefficient(FrictionCoefficients(), velocity, deflection, now['normal_force'])
        law = fade_weight(velocity) * mu
        assert now['friction_coefficient'] == pytest.approx(law, rel=2e-3)


@hypothesis(deadline=None, max_examples=40)
@given(SHAKING)
def test_the_desired_force_is_odd(values):
    displacement = _held(values)
    one, other = make_controller().run(displacement), make_controller().run(-displacement)
    np.testing.assert_array_equal(one['desired_force'], -other['desired_force'])
    np.testing.assert_array_equal(one['damping_active'], other['damping_active'])


@pytest.mark.parametrize(
    'doubtful', [math.nan, math.inf, -math.inf, 1e300, np.nextafter(FARTHEST_DISPLACEMENT, 2.0)]
)
@pytest.mark.parametrize('shaken_for', [0.0, 1.0])
def test_a_doubtful_displacement_gives_0_ampere_and_leaves_no_mark(doubtful, shaken_for):
    controller, undisturbed = make_controller(), make_controller()
    for x in sine(8.0, 1e-3, shaken_for):
        controller.step(x)
        undisturbed.step(x)
    assert controller.step(doubtful) == 0.0
    assert controller.trace['current'] == 0.0
    assert controller.trace['damping_active'] == 0.0
    assert math.isnan(controller.trace['magnitude'])
    for x in sine(8.0, 1e-3, 0.2):
        assert controller.step(x) == undisturbed.step(x)
        assert controller.trace_record.tobytes() == undisturbed.trace_record.tobytes()


def test_missing_samples_are_replaced_by_a_straight_line():
    displacement = sine(8.0, 1e-3, 0.5)
    gap = slice(300, 304)  # of 4 samples
    line = displacement.copy()
    line[gap] = np.interp(np.arange(300, 304), [299, 304], displacement[[299, 304]])
    bridged, complete = make_controller(), make_controller()
    bridged.run(displacement[:300])
    complete.run(line[:304])
    current = bridged.step(displacement[304], bridged_samples=4)
    assert current == pytest.approx(complete.step(displacement[304]), abs=1e-12)
    assert bridged.trace['bridged_samples'] == 4.0
    assert complete.trace['bridged_samples'] == 0.0
    for name in PAPER.trace.names[:-1]:
        assert bridged.trace[name] == pytest.approx(complete.trace[name], rel=1e-9, abs=1e-12), name


def test_restarting_forgets_the_past():
    used = make_controller()
    used.run(sine(8.0, 1e-3, 0.6))
    used.restart(0.003)
    fresh = make_controller()
    fresh.restart(0.003)
    displacement = 0.003 + sine(8.0, 1e-3, 0.6)
    assert _equal(used.run(displacement), fresh.run(displacement))


def test_a_mount_that_rests_anywhere_is_not_damped():
    controller = make_controller()
    controller.restart(0.012)
    traces = controller.run(np.full(1000, 0.012))
    assert not traces['damping_active'].any()
    assert traces['magnitude'].max() < 1e-15


def test_the_force_is_limited_by_the_table():
    currents, forces, offset = TABLE_ROWS
    settings = make_settings('viscous_4000')
    weak = settings.table(currents[:4], forces[:4], offset)  # up to 1 A and 75 N
    traces = Controller(ControlLaw(settings, weak)).run(sine(8.0, 2e-3, 1.0))
    assert traces['normal_force'].max() == 74.5
    assert traces['current'].max() == weak.currents[-1] < 1.0


def test_the_window_is_one_period_of_the_chosen_eigenfrequency():
    traces = make_controller(eigenfrequency=10.0).run(sine(10.0, 1e-3, 1.0))
    exceeded = int((traces['magnitude'] > 0.0008).argmax())
    assert int(traces['damping_active'].argmax()) == exceeded + 99
    assert switched_viscous.Parameters(eigenfrequency=10.0).period_samples(0.001) == 100
    assert damper_curve('viscous_2000').force(0.104) == pytest.approx(200.0)


# What is no finite number inside the controller, however it came there.


def _poisoned(controller, name, value):
    """Put `value` into a number of the memory, or into the whole window of the magnitude."""
    memory = controller.memory
    numbers = memory.window if name == 'window' else memory.state.view(PAPER.state)['policy']['band'][name]
    numbers[:] = value


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('bridged', [0, 3])
@pytest.mark.parametrize('name', ['z1', 'earlier', 'window'])
def test_a_spoiled_memory_ends_damping_in_the_same_step_and_begins_afresh(name, value, bridged):
    displacement = sine(8.0, 1e-3, 1.2)
    controller, fresh = make_controller(), make_controller()
    before = controller.run(displacement[:507])[-1]
    assert before['damping_active'] == 1.0
    assert before['current'] > 0.4935
    _poisoned(controller, name, value)
    assert controller.step(displacement[507], bridged) == 0.0
    assert controller.faults == 1
    assert controller.trace['damping_active'] == 0.0
    assert controller.trace['current'] == controller.trace['normal_force'] == 0.0
    assert math.isnan(controller.trace['magnitude'])
    # from here on as a controller that has just begun
    fresh.restart(displacement[507])
    after = controller.run(displacement[508:])
    assert _equal(after, fresh.run(displacement[508:]))
    assert after[-1]['damping_active'] == 1.0
    assert controller.faults == 1


def test_a_table_or_a_law_that_is_no_number_never_becomes_a_current():
    controller = make_controller()
    controller.run(sine(8.0, 1e-3, 0.5))
    controller.memory.tables.current[:] = math.nan
    traces = controller.run(sine(8.0, 1e-3, 0.5))
    assert (traces['current'] == 0.0).all()
    assert (traces['damping_active'] == 0.0).all()
    assert controller.faults > 0


# Another law while the controller works.

CHANGES = {
    'stronger damper': {'damper': 'viscous_4000'},
    'weaker damper': {'damper': 'viscous_1000'},
    'no damper at all but its end': {'damper': '{velocity: [0, 0.9, 1.0], force: [0, 0, 10]}'},
    'later': {'lead_time': 0.008},
    'lower eigenfrequency': {'eigenfrequency': 6.0},
    'higher eigenfrequency': {'eigenfrequency': 11.0},
    'wider band': {'quality': 0.5},
    'narrower band': {'quality': 3.0},
    'levels': {'switch_on_level': 0.0006, 'switch_off_level': 0.0002},
    'always': {'switching': 'always'},
    'all at once': {'damper': 'progressive', 'eigenfrequency': 7.0, 'quality': 2.0, 'lead_time': 0.0},
}


@pytest.mark.parametrize('moment', range(700, 825, 11))  # everywhere in a period
@pytest.mark.parametrize('change', CHANGES)
def test_a_change_of_the_law_makes_no_jump(change, moment):
    displacement = sine(8.0, 1e-3, 1.4)
    controller, stayed = make_controller(), make_controller()
    before = controller.run(displacement[:moment])
    controller.change(make_law(**CHANGES[change]))
    after = controller.run(displacement[moment:])
    undisturbed = stayed.run(displacement)
    assert before['damping_active'][-1] == after['damping_active'][0] == 1.0
    # the current stands still for one sample, and goes over within 50 ms
    assert after['current'][0] == before['current'][-1]
    free = make_controller(**CHANGES[change]).run(displacement)
    natural = max(np.abs(np.diff(run['current'][500:])).max() for run in (undisturbed, free))
    farthest = np.abs(free['current'][moment:] - undisturbed['current'][moment:]).max() + natural
    # a filter of a higher frequency accelerates more from the same place, by the square of the ratio
    stiffer = max(1.0, (CHANGES[change].get('eigenfrequency', 8.0) / 8.0) ** 2)
    assert np.abs(np.diff(after['current'][:60])).max() <= stiffer * natural + farthest / (1e3 * FADE_TIME)
    # and in the end it does what a controller does that never knew anything else
    settled = after[-125:]
    np.testing.assert_allclose(settled['current'], free['current'][-125:], atol=2e-2)
    assert controller.faults == 0


def test_a_change_that_leaves_the_band_pass_alone_leaves_it_alone_to_the_bit():
    displacement = sine(8.0, 1e-3, 1.0)
    controller, stayed = make_controller(), make_controller()
    controller.run(displacement[:700])
    controller.change(make_law('viscous_4000'))
    after, undisturbed = controller.run(displacement[700:]), stayed.run(displacement)[700:]
    for name in ('band_displacement', 'band_velocity', 'predicted_velocity', 'magnitude', 'damping_active'):
        np.testing.assert_array_equal(after[name], undisturbed[name])
    np.testing.assert_array_equal(after['desired_force'], 2.0 * undisturbed['desired_force'])


def test_a_change_while_damping_is_off_is_there_at_once():
    displacement = np.r_[sine(8.0, 0.1e-3, 0.5), sine(8.0, 1e-3, 1.0)]
    controller = make_controller()
    controller.run(displacement[:400])
    controller.change(make_law('viscous_4000'))
    after = controller.run(displacement[400:])
    expected = make_controller('viscous_4000').run(displacement)[400:]
    assert _equal(after, expected)


@pytest.mark.parametrize('eigenfrequency', [5.0, 8.0, 13.0])
def test_the_magnitude_stays_the_highest_of_the_last_period_over_a_change_of_it(eigenfrequency):
    displacement = sine(8.0, 1e-3, 0.6) * np.linspace(0.2, 1.0, 600)
    controller = make_controller()
    before = controller.run(displacement[:333])
    controller.change(make_law(eigenfrequency=eigenfrequency))
    after = controller.run(displacement[333:])
    distances = np.abs(np.r_[before['band_displacement'], after['band_displacement']])
    period = switched_viscous.Parameters(eigenfrequency=eigenfrequency).period_samples(0.001)
    seen_from = max(0, 333 - 125)  # what the window of the old period held
    for number in range(333, 600):
        begin = max(number + 1 - period, seen_from)
        assert after['magnitude'][number - 333] == distances[begin : number + 1].max()
