"""Parameters of the initialisation: the current ramp, what makes a result credible, and the timeouts.

What belongs to the actuator and its calibration (rest current 0.2 A, crossing inductance 20 mH, ranges of the
gap curves, stiffnesses) stands in the specimen and nowhere else.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SampleRate

_WIDE = 'chosen: seven standard deviations or more at 1 % ripple noise'


class InitParameters(NamedTuple):
    """All parameters of `mount_init`; the ramp with these values takes 2.75 s."""

    sample_rate: SampleRate = SAMPLE_RATE
    rise_duration: Annotated[
        float, Quantity('s', 'smooth rise from 0 A to the rest current, and fall back to 0 A', 0.02, 1.0)
    ] = 0.05
    dwell_duration: Annotated[
        float, Quantity('s', 'time at the rest current, once before and once after the ramp', 0.05, 5.0)
    ] = 0.3
    settle_duration: Annotated[
        float,
        Quantity('s', 'first part of each dwell, not used: the halves settle', 0.0, 1.0),
    ] = 0.05
    ramp_duration: Annotated[
        float, Quantity('s', 'smooth ramp from the rest current to the peak, and the same back', 0.2, 10.0)
    ] = 1.0
    peak_duration: Annotated[float, Quantity('s', 'time at the peak current', 0.0, 1.0)] = 0.02
    tail_duration: Annotated[float, Quantity('s', 'time at 0 A at the end', 0.005, 1.0)] = 0.03
    peak_current: Annotated[
        float,
        Quantity('A', 'highest current of ramp and current-force table', 2.0, HIGHEST_CURRENT, 'section 3.2'),
    ] = HIGHEST_CURRENT
    light_pressure: Annotated[
        float,
        Quantity('N', 'normal force in the ready position', 0.0, 20.0, 'chosen; section 3.2'),
    ] = 0.5

    crossing_half_width: Annotated[
        float, Quantity('A', 'samples this near to the crossing locate it', 0.05, 0.4)
    ] = 0.2
    monotone_half_width: Annotated[
        float, Quantity('A', 'the inductance must fall within this distance of the crossing', 0.1, 0.6)
    ] = 0.25
    valid_share: Annotated[
        float, Quantity('1', 'least share of valid samples in each part of the ramp', 0.1, 1.0)
    ] = 0.8
    rejected_share: Annotated[
        float, Quantity('1', 'largest share of outliers and of slopes with wrong sign', 0.0, 0.5)
    ] = 0.1
    following_error: Annotated[
        float, Quantity('A', 'largest difference of coil current and setpoint', 0.02, 1.0)
    ] = 0.15
    following_duration: Annotated[
        float, Quantity('s', 'how long the coil current may differ by more than that', 0.002, 0.5)
    ] = 0.02
    invalid_duration: Annotated[
        float,
        Quantity('s', 'how long samples may be invalid while the coil is driven', 0.01, 1.0),
    ] = 0.1
    stuck_duration: Annotated[
        float,
        Quantity('s', 'how long a reading may keep its last bit during the ramp', 0.01, 1.0),
    ] = 0.06
    rest_current_tolerance: Annotated[
        float,
        Quantity(
            'A', 'largest offset of the current in a dwell; 5 mA are worth 1 um', 0.001, 0.05, 'derived'
        ),
    ] = 0.005
    rest_gap_tolerance: Annotated[
        float,
        Quantity('m', 'largest change of the rest gap from first to last dwell', 1e-6, 1e-4, _WIDE),
    ] = 12e-6
    crossing_gap_tolerance: Annotated[
        float, Quantity('m', 'largest difference of the crossing gap up and down', 1e-6, 1e-4, _WIDE)
    ] = 6e-6
    resistance_tolerance: Annotated[
        float,
        Quantity(
            '1', 'largest relative deviation of the resistance of the coil at its temperature', 0.02, 0.5
        ),
    ] = 0.15
    smallest_travel: Annotated[
        float,
        Quantity('m', 'least way of the halves from the rest current to contact', 2e-6, 2e-4),
    ] = 8e-6
    smallest_peak_force: Annotated[
        float, Quantity('N', 'least normal force that the peak current must give', 0.0, 400.0)
    ] = 120.0
    largest_rest_gap_std: Annotated[
        float, Quantity('m', 'largest credible standard deviation of the rest gap', 1e-7, 5e-5)
    ] = 4e-6
    largest_contact_gap_std: Annotated[
        float, Quantity('m', 'largest credible standard deviation of the contact gap', 1e-7, 5e-5)
    ] = 2e-6

    coil_temperature_celsius: Annotated[
        float,
        Quantity(
            'degC', 'coil temperature where none is measured; NaN: unknown', -60, 250, may_be_unknown=True
        ),
    ] = math.nan

    silence_timeout: Annotated[
        float,
        Quantity('s', 'longest wait for the next ripple sample (wall clock)', 0.05, 60.0),
    ] = 1.0
    total_timeout: Annotated[
        float, Quantity('s', 'longest activation, except in lock-step (wall clock)', 1.0, 600.0)
    ] = 30.0
    quiet_duration: Annotated[
        float,
        Quantity('s', 'time without setpoints of others before a ramp (wall clock)', 0.01, 5.0),
    ] = 0.1
