"""The zero of a force sensor from the loop, where a contact that sticks at rest hides it; what it does."""

import numpy as np
import pytest
from joint import DT, jenkin, measured, motion

from engine_mount.identification.friction.laws import dahl_force
from engine_mount.identification.friction.screening import first_look
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_sim.plant.friction import full_response


@pytest.mark.parametrize('zero', [-400.0, 0.0, 250.0])
@pytest.mark.parametrize('play', [0.0, 1e-3])
def test_the_zero_is_known_although_the_contact_holds_a_force_at_rest(zero, play):
    x = motion(0.01)
    force = jenkin(x, (600.0, 600.0), 1e6, play, play + 0.5e-3)  # stuck at rest with a preload of 500 N
    recording = measured(x, force, zero)
    look = first_look(recording)
    rest = float(recording.force[:200].mean())
    assert abs(rest - zero) == pytest.approx(500.0, abs=5.0)
    assert abs(look.zero - zero) < 3.0 * look.deviation + 3.0
    assert abs(look.zero - zero) < 20.0
    assert look.deviation < 120.0
    assert look.known


def test_friction_that_differs_by_direction_is_within_the_stated_deviation_where_only_sliding_is_seen():
    x = motion(0.02)
    recording = measured(x, jenkin(x, (650.0, 550.0), 2e7, 0.0, 0.0), 0.0)
    look = first_look(recording)
    assert 20.0 < abs(look.zero) < 60.0  # 50 N of it may be a zero or the direction: nothing tells
    assert abs(look.zero) < 3.0 * look.deviation


def test_play_determines_the_zero_even_where_friction_differs_by_direction():
    x = motion(0.01)
    recording = measured(x, jenkin(x, (700.0, 500.0), 1e6, 2e-3, 0.0), 120.0)
    assert first_look(recording).zero == pytest.approx(120.0, abs=15.0)


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_laws_that_are_not_the_fitted_one_have_their_zero_within_three_deviations(seed):
    random = np.random.default_rng(seed)
    zero = float(random.uniform(-60.0, 60.0))
    x = motion(3e-3, 0.7)
    pads, _, _ = full_response(FrictionContact(), FrictionCoefficients(), x, np.full(x.size, 100.0), DT)
    dahl = dahl_force(np.array([0.5, 0.52, 3e5]), x, DT, np.full((x.size, 2), 100.0))
    for force in (pads, dahl):
        look = first_look(measured(x, force, zero, seed))
        assert abs(look.zero - zero) < 3.0 * look.deviation
        assert look.known
