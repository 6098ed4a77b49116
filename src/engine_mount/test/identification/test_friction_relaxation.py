"""The linear part of the contact from Eqs (10), (11): published example, right and as printed."""

import numpy as np
import pytest

from engine_mount.identification.friction.steps.ramp_response import contact_of_response, printed_formulas
from engine_mount.identification.friction.steps.relaxation import fit_relaxation
from mount_models.friction.contact import FrictionContact

C_RE, C_R, D_R, P = 4.0e6, 1.0e7, 5.0e6, 2.0e6
JOINT = C_RE * C_R / (C_RE + C_R)
LAG = 0.4411764706
RAMP_TIME = 0.2


def test_step_one_recovers_the_published_example_exactly():
    found = contact_of_response(2.857142857e6, P, 1.0 - 0.19047619, LAG)
    assert found == pytest.approx(FrictionContact(C_R, D_R, C_RE), rel=1e-6)


def test_the_printed_formulas_give_the_published_wrong_answers():
    with_p = JOINT * P / (JOINT + P)
    first_over_last = (1.0 / (1.0 / C_RE + 1.0 / P)) / with_p
    found = printed_formulas(JOINT, with_p, P, first_over_last, LAG)
    assert found.contact_stiffness == pytest.approx(C_RE, rel=1e-6)
    assert found.tangential_stiffness_with_p == pytest.approx(1.67e6, abs=5e3)
    assert found.tangential_stiffness_without_p == pytest.approx(C_R, rel=1e-6)
    assert found.tangential_damping == pytest.approx(4.41e6, abs=5e3)


def test_the_amplitude_behind_a_ramp_is_taken_back_to_that_of_a_step():
    time = np.arange(0.0, 5.0, 1e-3)
    found = fit_relaxation(time, 1e-6 * (1.0 - 0.24099 * np.exp(-time / 0.44118)), 1.0)
    assert found.amplitude == pytest.approx(0.24099e-6, rel=1e-5)
    assert found.at(time)[0] == pytest.approx(0.75901e-6, rel=1e-5)
    assert found.kappa(0.0) == pytest.approx(1.0 - 0.24099, rel=1e-5)
    assert found.kappa(RAMP_TIME) == pytest.approx(1.0 - 0.19048, abs=1e-5)
