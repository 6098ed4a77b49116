"""One engine on several simulated mounts: the limit of one mount, what each has for itself, refusals."""

import numpy as np
import pytest

from mount_models.quantity import ParameterError
from mount_sim.excitation.building import build_excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import ALONE, PLACES, general_name, mount_names, values_of_mount
from mount_sim.plant.simulated_car import SimulatedCar, mount_parameters

STIFF = {
    'mounts': ','.join(PLACES),
    'engine.roll_inertia': 0.1,
    'vehicle.elastomer.static_stiffness': 1e7,
    **{f'places.{name}.y': 2.0 if name in ('left', 'front') else -2.0 for name in PLACES},
}
SHORT = {'timeline.start': 0.1, 'timeline.duration': 1.2, 'motorway.gap_time': 0.4}


def car(**changes):
    values = {**SHORT, 'mounts': 'left,right', **changes}
    return SimulatedCar(values, build_excitation(mount_parameters(values)))


def drive(simulated, setpoint=lambda name, sample: 0.0):
    """Return the truth of each mount, {name: (samples,)}, and the readings (samples, 4)."""
    mounts = simulated.mounts
    truths, readings = {name: [] for name in mounts}, {name: [] for name in mounts}
    while not all(mount.finished for mount in mounts.values()):
        for name, mount in mounts.items():
            readings[name].append(mount.measure())
            truths[name].append(mount.truth.copy())
            mount.advance(setpoint(name, mount.sample))
    return {name: np.array(of) for name, of in truths.items()}, {
        n: np.array(of) for n, of in readings.items()
    }


def pulses(_, sample):
    return 1.2 if sample // 100 % 3 else 0.0


@pytest.mark.parametrize('scenario', ['motorway', 'bench', 'sweep'])
def test_two_mounts_beside_the_engine_do_what_one_does_under_its_share(scenario):
    changes = {**SHORT, 'scenario': scenario}
    truths, _ = drive(car(scenario=scenario), pulses)
    alone = car(**changes, mounts='').mounts[ALONE]
    expected = []
    while not alone.finished:
        alone.measure()
        expected.append(alone.truth.copy())
        alone.advance(pulses('', alone.sample))
    for name in ('displacement', 'velocity', 'friction_force', 'mount_force', 'chassis_acceleration', 'gap'):
        wanted = np.array(expected)[name]
        np.testing.assert_allclose(
            truths['left'][name], wanted, rtol=0, atol=1e-9 * abs(wanted).max() + 1e-15
        )
        np.testing.assert_array_equal(truths['left'][name], truths['right'][name])


def test_each_mount_has_noise_of_its_own_that_the_others_do_not_change():
    two, four = drive(car())[1], drive(car(mounts='right,front,left,rear'))[1]
    noise = two['left'][:100, 0], two['right'][:100, 0]
    assert not np.array_equal(*noise)
    assert abs(np.corrcoef(*noise)[0, 1]) < 0.4
    np.testing.assert_array_equal(four['left'][:100], two['left'][:100])
    again = drive(car(seed=2))[1]
    assert not np.array_equal(again['left'][:100, 0], noise[0])


def test_current_in_one_mount_alone_rolls_the_engine():
    truths, _ = drive(car(), lambda name, sample: 1.5 if name == 'left' else 0.0)
    left, right = (truths[name]['displacement'] for name in ('left', 'right'))
    assert abs(left).max() < 0.5 * abs(right).max()
    mirrored, _ = drive(car(), lambda name, sample: 1.5 if name == 'right' else 0.0)
    np.testing.assert_allclose(mirrored['right']['displacement'], left, rtol=0, atol=1e-15)


def test_parameters_of_one_mount_are_its_own():
    truths, _ = drive(
        car(**{'mount_right.mechanics.contact_gap': 360e-6, 'mount_left.mount': 'elastomer'}), pulses
    )
    assert truths['left']['contact_gap'][0] == SimParameters().mechanics.contact_gap
    assert truths['right']['contact_gap'][0] == 360e-6
    assert not truths['left']['friction_force'].any()
    assert truths['right']['friction_force'].any()


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'mounts': 'left,middle'}, "'middle' is no place; known are left, right, front, rear"),
        ({'mounts': 'left,left'}, 'must name each place once'),
        ({'mounts': 'left'}, 'nothing holds it against heave, roll or pitch'),
        ({'engine.rod_lever': 0.0}, 'or the torque rod a lever'),
        ({'mount_left.seed': 2}, "'seed' is common to all mounts"),
        ({'mount_left.vehicle.body_mass': 2.0}, 'is common to all mounts'),
        ({'mount_left.electronics.clock_drift': 1e-5}, 'is common to all mounts'),
        (STIFF, 'would grow without end'),
    ],
)
def test_what_does_not_fit_together_is_refused(changes, words):
    with pytest.raises(ParameterError, match=words):
        car(**changes)


def test_names_of_mounts_and_of_their_parameters():
    assert mount_names('') == ()
    assert mount_names(' left, rear ') == ('left', 'rear')
    assert general_name('mount_left.friction.scale') == 'friction.scale'
    assert general_name('friction.scale') == 'friction.scale'
    values = {'friction.scale': 1.1, 'mount_left.friction.scale': 1.2, 'mount_right.mount': 'hydro'}
    assert values_of_mount(values, 'left') == {'friction.scale': 1.2}
    assert values_of_mount(values, 'right') == {'friction.scale': 1.1, 'mount': 'hydro'}
    assert PLACES == ('left', 'right', 'front', 'rear')
