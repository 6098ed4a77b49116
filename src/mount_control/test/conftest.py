"""What the tests share: a force table as an initialisation makes it, controllers."""

import numpy as np
import pytest

from mount_control.controller import ControlLaw, Controller
from mount_control.settings import ControlSettings, control_settings
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import default_specimen

# Currents (A) and normal forces (N) of a closing actuator, rounded; the first is the touch of the pads.
CURRENTS = np.array([0.4725, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])
FORCES = np.array([0.0, 2.6, 35.0, 75.0, 180.6, 261.0, 304.8])
OFFSET_CURRENT = 0.4935


@pytest.fixture(scope='session')
def table_rows():
    """Currents (A), normal forces (N) and offset current (A) of an activation."""
    return CURRENTS, FORCES, OFFSET_CURRENT


@pytest.fixture(scope='session')
def make_settings():
    """Return a function that builds the settings of the paper's policy with some parameters changed."""

    def make(damper: str = 'viscous_2000', **changes) -> ControlSettings:
        settings = control_settings(
            {'policy': 'switched_viscous', 'damper': damper, **changes}, default_specimen()
        )
        return settings._replace(friction=FrictionCoefficients(), contact=FrictionContact())

    return make


@pytest.fixture(scope='session')
def make_law(make_settings):
    """Return a function that builds a law with some parameters changed."""

    def make(damper: str = 'viscous_2000', **changes) -> ControlLaw:
        settings = make_settings(damper, **changes)
        return ControlLaw(settings, settings.table(CURRENTS, FORCES, OFFSET_CURRENT))

    return make


@pytest.fixture(scope='session')
def make_controller(make_law):
    """Return a function that builds a controller with some parameters changed."""
    return lambda *arguments, **changes: Controller(make_law(*arguments, **changes))


@pytest.fixture(scope='session')
def sine():
    """Return a function that samples a sine at 1 kHz: frequency (Hz), amplitude, duration (s)."""

    def sampled(frequency: float, amplitude: float, duration: float):
        return amplitude * np.sin(2.0 * np.pi * frequency * 1e-3 * np.arange(round(duration * 1e3)))

    return sampled
