"""Where a recording tells of microslip and where of macroslip."""

import numpy as np
import pytest

from engine_mount.identification.friction.recording import checked_recording
from engine_mount.identification.friction.sawtooth import slip_regions, stroke_lines
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient
from mount_models.friction.contact import FrictionContact
from mount_sim.plant.friction import full_response

CONTACT, COEFFICIENTS, LOAD = FrictionContact(), FrictionCoefficients(), 100.0
CORNERS = np.cumsum([0.0, 0.5, 1.0, 1.0, 0.5])
"""s: half a stroke and two whole ones at 2 mm/s, then a whole one at 4 mm/s; turns at 0.5, 1.5 and 2.5 s."""


@pytest.fixture(scope='module')
def recording():
    time = np.arange(0.0, CORNERS[-1], 1e-3)
    x = np.interp(time, CORNERS, [0.0, 1e-3, -1e-3, 1e-3, -1e-3])
    force = full_response(CONTACT, COEFFICIENTS, x, np.full(x.size, LOAD), 1e-3)[0]
    return checked_recording('saw tooth', time, x, force, LOAD)


def test_every_stroke_begins_in_microslip_and_slow_ones_are_faded(recording):
    regions = slip_regions(recording, CONTACT)
    for turn in (500, 1500, 2500):
        assert regions.micro[turn + 1 : turn + 25].all()
        assert not any(region[turn - 9 : turn].any() for region in regions)
    assert regions.faded[1600:2450].all()
    assert regions.macro[2600:2950].all()
    assert not regions.macro[:2500].any()
    assert not (regions.micro & (regions.macro | regions.faded)).any()


def test_a_line_tells_its_window_the_speeds_of_pads_and_slider_and_how_mu_falls(recording):
    line = stroke_lines(recording, CONTACT)[-1]
    assert line.stroke.start == pytest.approx(2500, abs=1)
    assert line.stroke.start < line.window.start < line.window.stop < line.stroke.stop
    assert line.window.stop - line.window.start == line.mu.size
    assert line.displacement_velocity == pytest.approx(-4e-3, rel=1e-6)
    assert 0.98 < line.velocity / line.displacement_velocity < 0.9999
    assert line.fall == pytest.approx(line.mu[0] - line.mu[-1], abs=0.005)
    assert line.fall > 0.05
    assert line.residual < 1e-3
    assert line.a == pytest.approx(offset_coefficient(COEFFICIENTS, line.velocity, LOAD), abs=2e-3)
