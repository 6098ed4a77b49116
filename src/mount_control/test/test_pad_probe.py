"""The probe of the pads: pulses of constant current, whatever the mount does, and 0 A once it moves."""

import numpy as np
import pytest
from controllers import TABLE_ROWS, sine

from mount_control.controller import ControlLaw, Controller
from mount_control.settings import control_settings
from mount_models.specimen import default_specimen

SHORT = {'wait': 0.5, 'pulse_duration': 0.3, 'pulses': 4.0, 'friction_force': 40.0}
IDLE = sine(26.7, 6e-5, 4.0)


def law(**own):
    values = {'policy': 'pad_probe', **{f'pad_probe.{name}': value for name, value in (SHORT | own).items()}}
    settings = control_settings(values, default_specimen())
    return ControlLaw(settings, settings.table(*TABLE_ROWS))


def test_pulses_of_constant_current_rise_by_squares_and_end_by_themselves():
    traces = Controller(law()).run(IDLE)
    numbers = np.zeros(4000)
    for k in range(4):
        numbers[500 + 600 * k : 800 + 600 * k] = k + 1
    np.testing.assert_array_equal(traces['pulse'], numbers)
    np.testing.assert_allclose(traces['desired_force'], 40.0 * (numbers / 4) ** 2, rtol=1e-12)
    assert (traces['current'][numbers == 0] == 0.0).all()
    for k in range(1, 5):
        settled = traces['current'][numbers == k][100:]
        assert np.ptp(settled) < 1e-2 * settled[-1]


def test_the_displacement_of_an_idling_engine_changes_nothing():
    rough = IDLE + sine(7.0, 1.5e-4, 4.0) + 3e-6 * np.random.default_rng(1).standard_normal(4000)
    currents = [Controller(law()).run(x)['current'] for x in (np.zeros(4000), rough)]
    np.testing.assert_array_equal(*currents)


@pytest.mark.parametrize('moved', [600, 1000])  # in a pulse, in a pause
def test_a_car_that_moves_ends_the_probe(moved):
    moving = IDLE.copy()
    moving[moved] += 5e-4
    current = Controller(law()).run(moving)['current']
    assert (current[500 : min(moved, 800)] > 0.0).all()
    assert (current[moved:] == 0.0).all()


def test_a_probe_that_has_ended_does_not_begin_again_with_other_parameters():
    controller = Controller(law())
    controller.run(IDLE)
    controller.change(law(pulses=8.0))
    assert (controller.run(IDLE)['current'] == 0.0).all()
