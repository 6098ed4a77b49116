"""Which plants can be simulated: what is refused would blow up, what passes does not."""

import numpy as np
import pytest

from mount_models.quantity import ParameterError, with_flattened
from mount_sim.electronics.electronics import Noise
from mount_sim.excitation.excitation import Seat
from mount_sim.parameters import SimParameters
from mount_sim.plant.car import checked_plant
from mount_sim.plant.mounts import MOUNTS
from mount_sim.plant.plant import PlantSimulation

STEP = 5e-5  # s


def _plant(mount='friction', **changes):
    values = {'mount': mount, **{name.replace('__', '.'): value for name, value in changes.items()}}
    return with_flattened(SimParameters(), values).plant


def _moved(plant, seat, seconds):
    """The displacement after so long, pushed by the road or the chassis in the first step."""
    simulation = PlantSimulation(plant, seat, STEP)
    values = np.zeros(round(seconds / STEP))
    values[0] = 1e-3
    simulation.advance(values, np.zeros(len(values)), 0.0)
    return simulation.read(np.zeros(Noise.NUMBERS))[0]


@pytest.mark.parametrize('seat', Seat)
@pytest.mark.parametrize('mount', MOUNTS)
def test_the_default_plants_pass(mount, seat):
    checked_plant(_plant(mount), seat, STEP)


@pytest.mark.parametrize(
    ('changes', 'seat', 'culprit'),
    [
        (
            {'vehicle__chassis_damping': 1e6},
            Seat.VEHICLE,
            r'vehicle\.chassis_damping \(1e\+06\) do not fit together',
        ),
        ({'vehicle__wheel_mass': 1.0, 'vehicle__suspension_damping': 1e6}, Seat.VEHICLE, 'vehicle.'),
    ],
)
def test_what_would_blow_up_is_refused_with_the_culprit(changes, seat, culprit):
    plant = _plant(**changes)
    with pytest.raises(ParameterError, match=culprit) as refused:
        checked_plant(plant, seat, STEP)
    assert 'in steps of 50 us the motion of the simulated plant would grow without end' in str(refused.value)
    assert not abs(_moved(plant, seat, 2.0)) < 1.0


def test_a_vehicle_that_does_not_move_is_not_judged():
    checked_plant(_plant(vehicle__chassis_damping=1e6), Seat.BENCH, STEP)
    checked_plant(_plant(vehicle__chassis_damping=1e6), Seat.ACCELERATED_CHASSIS, STEP)


def test_a_fluid_that_would_blow_up_is_refused_where_it_is_in_the_mount():
    changes = {'hydromount__upper_compliance': 1e-13, 'hydromount__decoupler_inertance': 1e3}
    with pytest.raises(ParameterError, match='hydromount'):
        checked_plant(_plant('hydro', **changes), Seat.BENCH, STEP)
    checked_plant(_plant('elastomer', **changes), Seat.BENCH, STEP)
