"""The paper's policy (sections 5 and 6, Fig. 12): a damper characteristic, on while the engine shakes.

The magnitude of the band-passed displacement switches; the force is that of the characteristic at the
velocity in the band, turned ahead by the delay of the loop.
"""

from typing import Annotated, NamedTuple

from mount_control import band_pass, switching
from mount_control.delay import LOOP_DELAY, check_lead, delay_at
from mount_control.policy.contract import Design
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.damper import damper_curve, damper_force
from mount_models.quantity import ParameterError, Quantity, nearest

DEFAULT_DAMPER = 'viscous_2000'
SWITCHING = {
    'enabled': 'damping is switched on and off by the magnitude',
    'always': 'damping goes on one period after activation and never off, whatever the magnitude',
}
"""Values of `switching`, and what they mean."""


class Parameters(NamedTuple):
    """Parameters of band-pass, prediction, switching and damper characteristic."""

    switching: Annotated[
        str,
        Quantity(
            'word', ', '.join(f'{word}: {what}' for word, what in SWITCHING.items()), words=tuple(SWITCHING)
        ),
    ] = 'enabled'
    eigenfrequency: Annotated[
        float,
        Quantity(
            'Hz', 'centre of the band-pass: eigenfrequency of the engine', 2.0, 20.0, 'paper, section 5'
        ),
    ] = 8.0
    quality: Annotated[
        float,
        Quantity('1', 'quality of the band-pass; small: less phase error off the centre', 0.3, 5.0),
    ] = 1.0
    lead_time: Annotated[
        float,
        Quantity(
            's',
            'time from a sample to the middle of the effect of its setpoint at 1 kHz: 1 ms until the '
            'electronics take it over, 0.5 ms half its hold, 0.4 ms current loop of 400 Hz',
            0.0,
            0.015,
            'derived',
        ),
    ] = LOOP_DELAY
    switch_on_level: Annotated[
        float, Quantity('m', 'magnitude above which damping is switched on', 1e-5, 0.01, 'paper, section 6')
    ] = 0.0008
    switch_off_level: Annotated[
        float, Quantity('m', 'magnitude below which damping is switched off', 1e-6, 0.01, 'paper, section 6')
    ] = 0.00035
    damper: Annotated[
        str,
        Quantity(
            'damper',
            'characteristic, force over velocity: a name such as viscous_2000 (N s/m), a law, points, or the '
            'path of a file',
        ),
    ] = DEFAULT_DAMPER

    def period_samples(self, sample_time: float) -> int:
        """Return the samples in one period of the eigenfrequency, `sample_time` s apart."""
        return max(1, round(1.0 / (self.eigenfrequency * sample_time)))


_ANY_MAGNITUDE = -1.0  # m: each one lies above, none below


class Law(NamedTuple):
    """Band-pass, levels, and the grid of the damper characteristic in m/s."""

    band: band_pass.BandPass
    switching: switching.Switching
    damper_step: float


STATE = record_type([('band', band_pass.STATE), ('switching', switching.STATE)])
TRACE = {
    'band_displacement': 'm',
    'band_velocity': 'm/s',
    'predicted_velocity': 'm/s',
    'magnitude': 'm',
}


def design(parameters: Parameters, sample_time: float) -> Design:
    """Return the law with the table of the characteristic, force (N) over speed, and a window of one period.

    Raises `ParameterError`, for the characteristic too.
    """
    _check(parameters)
    lead_time = delay_at(parameters.lead_time, sample_time)
    band = band_pass.design(parameters.eigenfrequency, parameters.quality, lead_time, sample_time)
    period = parameters.period_samples(sample_time)
    if parameters.switching == 'always':
        levels = switching.Switching(_ANY_MAGNITUDE, _ANY_MAGNITUDE, period)
    else:
        levels = switching.Switching(parameters.switch_on_level, parameters.switch_off_level, period)
    damper = damper_curve(parameters.damper)
    return Design(Law(band, levels, damper.velocity_step), damper.table, period)


def _check(parameters: Parameters) -> None:
    if parameters.switching not in SWITCHING:
        raise ParameterError(
            f'switching {parameters.switching!r} is unknown; {nearest(parameters.switching, SWITCHING)}'
        )
    if not parameters.switch_off_level < parameters.switch_on_level:
        raise ParameterError(
            f'switch_off_level ({1e3 * parameters.switch_off_level:g} mm) must lie below switch_on_level '
            f'({1e3 * parameters.switch_on_level:g} mm), else damping switches on and off at every period'
        )
    check_lead(parameters.lead_time, parameters.eigenfrequency)


@compiled
def start(law, state, window, displacement):
    """Set a memory of zeros to a mount at rest at `displacement` (m), damping off."""
    band_pass.settle(law.band, state.band, displacement)


@compiled
def transfer(law, new_law, state, window, new_window):
    """Go on from the same last samples; magnitude and switching keep their past."""
    band_pass.transfer(law.band, new_law.band, state.band)
    switching.transfer(state.switching, window, new_window)


@compiled
def step(law, table, state, window, trace, displacement, crank_frequency):
    """Take one sample (m); return force (N), velocity (m/s) at which it acts, and damping active 0 or 1."""
    banded, velocity, predicted = band_pass.step(law.band, state.band, displacement)
    magnitude, active = switching.step(law.switching, state.switching, window, banded)
    trace.band_displacement = banded
    trace.band_velocity = velocity
    trace.predicted_velocity = predicted
    trace.magnitude = magnitude
    force = damper_force(table, law.damper_step, predicted) if active == 1 else 0.0
    return force, predicted, float(active)
