"""A force table as an initialisation makes it, controllers that work on it, and how tests shake them."""

import numpy as np

from mount_control.controller import ControlLaw, Controller
from mount_control.settings import ControlSettings, control_settings
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import default_specimen

TABLE_ROWS = (
    np.array([0.4725, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0]),
    np.array([0.0, 2.6, 35.0, 75.0, 180.6, 261.0, 304.8]),
    0.4935,
)
"""Currents (A), normal forces (N) and offset current (A) of a closing actuator, rounded; the first current is
the touch of the pads."""


def make_settings(damper: str = 'viscous_2000', **changes) -> ControlSettings:
    """Return the settings of the paper's policy with some parameters changed."""
    settings = control_settings(
        {'policy': 'switched_viscous', 'damper': damper, **changes}, default_specimen()
    )
    return settings._replace(friction=FrictionCoefficients(), contact=FrictionContact())


def make_law(damper: str = 'viscous_2000', **changes) -> ControlLaw:
    """Return a law with some parameters changed."""
    settings = make_settings(damper, **changes)
    return ControlLaw(settings, settings.table(*TABLE_ROWS))


def make_controller(damper: str = 'viscous_2000', **changes) -> Controller:
    """Return a controller with some parameters changed."""
    return Controller(make_law(damper, **changes))


def sine(frequency: float, amplitude: float, duration: float) -> np.ndarray:
    """Return a sine of `frequency` (Hz) at 1 kHz over `duration` (s)."""
    return amplitude * np.sin(2.0 * np.pi * frequency * 1e-3 * np.arange(round(duration * 1e3)))
