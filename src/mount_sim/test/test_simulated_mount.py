"""Electronics and plant together, sample by sample."""

import numpy as np
import pytest
from simulated_mounts import drive, make_mount

from mount_models.quantity import ParameterError
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.plant import Plant, PlantSimulation


def test_a_setpoint_takes_effect_at_the_sample_after_the_one_it_answers():
    """As on the bus: the answer to sample k is there when sample k+1 is taken, and acts from then on."""
    mount, answer, currents = make_mount(), None, []
    for number in range(6):
        mount.measure()
        currents.append((mount.truth['current_setpoint'], mount.truth['coil_current']))
        mount.advance(answer)
        answer = 1.0 if number >= 2 else 0.0  # sample 2 is the first one answered with 1 A
    assert [setpoint for setpoint, _ in currents] == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    assert [current > 0.0 for _, current in currents] == [False, False, False, False, True, True]


@pytest.mark.parametrize(('timeout', 'samples'), [(0.020, 20), (0.005, 5)])
def test_without_setpoints_the_electronics_go_to_0_ampere_on_their_own(timeout, samples):
    last = 50
    mount = make_mount(electronics__setpoint_timeout=timeout)
    enabled = []

    def setpoint(number):
        enabled.append(mount.enabled)
        return 1.0 if number <= last else None

    _, truth = drive(mount, setpoint)
    setpoints = truth['current_setpoint']  # of the step that ends at the sample
    assert (setpoints[1 : last + 1 + samples] == 1.0).all()
    assert (setpoints[last + 1 + samples :] == 0.0).all()
    assert (truth['coil_current'][last + samples + 60 :] == 0.0).all()
    assert enabled == [number < last + 1 + samples for number in range(300)]


def test_a_setpoint_that_came_late_holds_the_shorter():
    mount, currents = make_mount(), []
    for number in range(60):
        mount.measure()
        currents.append(mount.truth['current_setpoint'])
        mount.advance(1.0 if number == 10 else None, 15)
    assert [number for number, current in enumerate(currents) if current > 0.0] == list(range(11, 16))


def test_equal_seeds_give_equal_readings_to_the_bit():
    def readings(seed):
        mount = make_mount(scenario='motorway', timeline__duration=1.0, seed=seed)
        numbers, truth = drive(mount, lambda number: 0.001 * number)
        return numbers.tobytes(), truth.tobytes()

    assert readings(5) == readings(5)
    assert readings(5)[0] != readings(6)[0]
    assert readings(5)[1] != readings(6)[1]


def test_the_noise_is_no_part_of_the_truth():
    quiet, quiet_truth = drive(make_mount(electronics__displacement_noise=0.0))
    noisy, noisy_truth = drive(make_mount(electronics__displacement_noise=1e-4))
    assert quiet_truth.tobytes() == noisy_truth.tobytes()
    np.testing.assert_array_equal(quiet[:, 0], quiet_truth['displacement'])
    assert np.std(noisy[:, 0] - noisy_truth['displacement']) == pytest.approx(1e-4, rel=0.2)


def test_an_impossible_plant_is_refused():
    crossed = Plant()._replace(mechanics=Plant().mechanics._replace(rest_gap=340e-6))
    with pytest.raises(ParameterError):
        PlantSimulation(crossed, Seat.BENCH, 5e-5)
    negative = Plant()._replace(friction=Plant().friction._replace(scale=-1.0))
    with pytest.raises(ParameterError, match='scale'):
        PlantSimulation(negative, Seat.BENCH, 5e-5)
