"""What a value becomes on its way over CAN, as compiled functions for runs without a bus.

Each function gives bit for bit what `MountCodec` gives after encoding and decoding, except where the codec
refuses a value: outside the limits of the DBC the result is NaN. Tests hold every number here against the
DBC and every result against the codec. The two slopes share one validity bit on the bus, which these
functions, one value each, do not know: where one slope is NaN, take both for NaN.
"""

import math

import numpy as np

from mount_models.arithmetic.compiled import compiled
from mount_models.sampling import HIGHEST_CURRENT

DISPLACEMENT_STEPS = 1.0e7  # per m
DISPLACEMENT_LIMIT = 500_000.0  # raw, both ways
COIL_CURRENT_STEPS = 5.0e3  # per A
COIL_CURRENT_LIMIT = 32_500.0
CURRENT_RATE_STEPS = 1.0e3  # per A/s
CURRENT_RATE_LIMIT = 100_000_000.0
FLUX_RATE_STEPS = 1.0e4  # per T/s
FLUX_RATE_LIMIT = 100_000_000.0
COIL_TEMPERATURE_STEPS = 10.0  # per K
COIL_TEMPERATURE_LOWEST = -600.0  # raw
COIL_TEMPERATURE_HIGHEST = 2500.0
SETPOINT_STEPS = 1.0e4  # per A


@compiled
def quantised_displacement(displacement):
    """Return the displacement (m) as it arrives, in steps of 0.1 um; NaN outside +-50 mm."""
    return _quantised(displacement, DISPLACEMENT_STEPS, DISPLACEMENT_LIMIT)


@compiled
def quantised_coil_current(current):
    """Return the mean coil current (A) as it arrives, in steps of 0.2 mA; NaN outside +-6.5 A."""
    return _quantised(current, COIL_CURRENT_STEPS, COIL_CURRENT_LIMIT)


@compiled
def quantised_current_rate(rate):
    """Return the slope of the current (A/s) as it arrives, in steps of 1 mA/s; NaN outside +-100 kA/s."""
    return _quantised(rate, CURRENT_RATE_STEPS, CURRENT_RATE_LIMIT)


@compiled
def quantised_flux_rate(rate):
    """Return the slope of the flux density (T/s) as it arrives, in 0.1 mT/s steps; NaN outside +-10 kT/s."""
    return _quantised(rate, FLUX_RATE_STEPS, FLUX_RATE_LIMIT)


@compiled
def quantised_coil_temperature(celsius):
    """Return the coil temperature (degC) as it arrives, in steps of 0.1 K; NaN outside -60..250 degC."""
    scaled = celsius * COIL_TEMPERATURE_STEPS
    if not COIL_TEMPERATURE_LOWEST <= scaled <= COIL_TEMPERATURE_HIGHEST:
        return math.nan
    return np.rint(scaled) / COIL_TEMPERATURE_STEPS + 0.0


@compiled
def quantised_setpoint_current(current):
    """Return the current setpoint (A) as it arrives, limited to 0..3 A in steps of 0.1 mA; NaN for NaN."""
    if math.isnan(current):
        return math.nan
    limited = min(max(current, 0.0), HIGHEST_CURRENT)
    return np.rint(limited * SETPOINT_STEPS) / SETPOINT_STEPS + 0.0


@compiled
def _quantised(value, steps, limit):
    scaled = value * steps
    if not abs(scaled) <= limit:
        return math.nan
    return np.rint(scaled) / steps + 0.0  # a whole number on the wire knows no negative zero
