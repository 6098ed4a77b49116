"""The mounts that can sit in the seat, and the energy in a vehicle with them."""

import numpy as np
import pytest
from simulated_mounts import drive, make_mount, parameters

from mount_models.quantity import ParameterError
from mount_sim.excitation.building import build_excitation
from mount_sim.plant.mounts import MOUNTS, seated_mount
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, ride_without_friction

PERIOD = 125  # samples of 8 Hz


def closed(number):
    """A setpoint that presses the pads."""
    return 1.0


def harmonics(truth):
    """Complex amplitudes (N) of harmonics 1 to 8 of the mount force over the last four periods."""
    force = truth['mount_force'][-4 * PERIOD :]
    return np.fft.rfft(force)[4 : 4 * 9 : 4] * 2.0 / len(force)


def test_the_hydromount_on_the_bench_has_its_harmonics_whatever_the_coil_does():
    expected = [277.8, 5.03, 13.23, 2.01, 5.36, 1.02, 2.32, 0.50]
    for setpoint in (closed, lambda number: None):
        _, truth = drive(make_mount(mount='hydro', timeline__duration=2.0), setpoint)
        np.testing.assert_allclose(np.abs(harmonics(truth)), expected, rtol=0.01, atol=0.03)
        assert (truth['friction_force'] == 0.0).all()


@pytest.mark.parametrize('mount', ['hydro', 'elastomer'])
def test_the_actuator_is_there_electrically_whatever_sits_in_the_seat(mount):
    readings, truth = drive(make_mount(mount=mount), closed)
    expected, with_pads = drive(make_mount(), closed)
    np.testing.assert_array_equal(readings[:, 1:], expected[:, 1:])
    for name in ('coil_current', 'gap', 'flux_density'):
        np.testing.assert_array_equal(truth[name], with_pads[name])


def test_the_driver_of_friction_off_opens_when_the_excitation_begins():
    _, truth = drive(make_mount(mount='friction_off', timeline__start=0.2), closed)
    assert truth['coil_current'][199] > 0.9  # until then the mount can be initialised
    assert (truth['current_setpoint'][201:] == 0.0).all()
    assert (truth['coil_current'][260:] == 0.0).all()
    assert (truth['friction_force'][260:] == 0.0).all()


def test_road_and_idle_force_move_the_vehicle_as_its_law_alone_says():
    chosen = {'scenario': 'motorway', 'timeline__duration': 0.5, 'idle__amplitude': 150.0}
    _, truth = drive(make_mount(mount='elastomer', **chosen))
    excitation = build_excitation(parameters(**chosen))
    displacement, _ = ride_without_friction(
        Vehicle(), resting_vehicle(), excitation.values[:], excitation.engine_forces[:], excitation.step_time
    )
    np.testing.assert_array_equal(truth['displacement'][1:], displacement[19::20][:-1])


def test_an_unknown_mount_is_refused_with_the_known_ones():
    with pytest.raises(ParameterError) as caught:
        seated_mount('rubber')
    assert str(caught.value) == f"mount 'rubber' is unknown; known are {', '.join(MOUNTS)}"
    with pytest.raises(ParameterError, match="mount 'rubber' is unknown"):
        _ = parameters(mount='rubber').plant
