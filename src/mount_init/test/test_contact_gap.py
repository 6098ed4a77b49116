"""Contact gap and force table that an initialisation finds, against the true mechanics."""

import math

import numpy as np
import pytest

from mount_init.estimate import contact_gap, rest_gap
from mount_models.actuator import contact_force, current_force_table
from mount_models.coil.crossing import find_crossing
from mount_models.specimen import default_specimen
from mount_sim.plant.closing import ClosingMechanics, closed_state
from mount_sim.plant.closing import contact_force as true_contact_force
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil, incremental_inductance

MAGNET, COIL, MOUNT = ReluctanceActuator(), RippleCoil(), ClosingMechanics()
KNOWN = default_specimen()
LAW, SPRING, PADS = KNOWN.force_law, KNOWN.spring_stiffness, KNOWN.pad_stiffness


@pytest.fixture(scope='module')
def initialised():
    """Return what an initialisation without noise finds: raw contact gap, corrected contact gap, rest gap."""
    currents = np.linspace(0.0, 3.0, 1501)
    gap, inductances = MOUNT.rest_gap, []
    for current in currents:
        gap, _ = closed_state(MOUNT, MAGNET, current, gap)
        inductances.append(incremental_inductance(COIL, MAGNET, current, gap))
    crossing = find_crossing(currents, inductances)
    rest = rest_gap(KNOWN, float(np.interp(KNOWN.rest_current, currents, inductances)), 0.0, math.nan)
    contact = contact_gap(KNOWN, rest, crossing.current, 0.0, math.nan)
    return contact.at_crossing, contact.gap, rest.gap


def true_normal_forces(currents):
    return np.array([closed_state(MOUNT, MAGNET, current, MOUNT.contact_gap)[1] for current in currents])


def test_an_initialisation_without_noise_finds_both_gaps_within_one_micrometre(initialised):
    _, contact, rest = initialised
    assert contact == pytest.approx(MOUNT.contact_gap, abs=1e-6)
    assert rest == pytest.approx(MOUNT.rest_gap, abs=1e-6)


def test_an_initialisation_without_noise_finds_the_contact_force_within_one_per_cent(initialised):
    _, contact, rest = initialised
    assert contact_force(SPRING, rest, contact) == pytest.approx(true_contact_force(MOUNT), rel=0.01)


def test_correcting_the_contact_gap_to_zero_load_avoids_most_of_the_force_error(initialised):
    raw, contact, rest = initialised
    currents = np.linspace(0.48, 1.15, 200)
    truth = true_normal_forces(currents)

    def error(gap):
        table = current_force_table(LAW, SPRING, PADS, rest, gap)
        estimate = np.interp(currents, table[0], table[1])
        return math.sqrt(np.mean((estimate - truth) ** 2)) / truth.max()

    assert error(contact) < 0.006
    assert error(raw) > 0.02


def test_the_table_meets_the_true_normal_force_within_one_per_cent_of_the_magnets_force(initialised):
    _, contact, rest = initialised
    currents = np.linspace(0.48, 3.0, 200)
    truth = true_normal_forces(currents)
    table = current_force_table(LAW, SPRING, PADS, rest, contact)
    error = np.interp(currents, table[0], table[1]) - truth
    assert np.all(np.abs(error) <= 0.01 * (truth + 22.26))  # of which the spring takes its part
    strong = truth > 20.0
    assert np.sqrt(np.mean((error[strong] / truth[strong]) ** 2)) <= 0.01
