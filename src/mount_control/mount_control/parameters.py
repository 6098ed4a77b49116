"""What can be set on the controller."""

import math
from typing import Annotated, NamedTuple

from mount_models.quantity import ParameterError, Quantity, checked
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME

DEFAULT_DAMPER = 'viscous_2000'


class ControlParameters(NamedTuple):
    """Parameters of band-pass, prediction, switching and output."""

    switching: str = 'enabled'
    eigenfrequency: Annotated[
        float,
        Quantity(
            'Hz', 'centre of the band-pass: eigenfrequency of the engine', 2.0, 20.0, 'paper, section 5'
        ),
    ] = 8.0
    quality: Annotated[
        float,
        Quantity('1', 'quality of the band-pass; small: less phase error off the centre', 0.3, 5.0, 'chosen'),
    ] = 1.0
    lead_time: Annotated[
        float,
        Quantity(
            's',
            'time from a sample to the middle of the effect of its setpoint: 1 ms until the electronics '
            'take it over, 0.5 ms half its hold, 0.4 ms current loop of 400 Hz',
            0.0,
            0.015,
            'derived',
        ),
    ] = 0.0019
    switch_on_level: Annotated[
        float, Quantity('m', 'magnitude above which damping is switched on', 1e-5, 0.01, 'paper, section 6')
    ] = 0.0008
    switch_off_level: Annotated[
        float, Quantity('m', 'magnitude below which damping is switched off', 1e-6, 0.01, 'paper, section 6')
    ] = 0.00035
    longest_bridge: Annotated[
        float,
        Quantity(
            's',
            'longest gap in the samples that is bridged; a longer one starts afresh',
            0.002,
            0.1,
            'chosen',
        ),
    ] = 0.020
    displacement_range: Annotated[
        float, Quantity('m', 'largest believable displacement to either side', 1e-3, 0.1, 'chosen')
    ] = 0.020
    highest_current: Annotated[
        float, Quantity('A', 'limit of the setpoint', 0.0, HIGHEST_CURRENT, 'paper, section 3')
    ] = HIGHEST_CURRENT

    @property
    def period_samples(self) -> int:
        """Samples in one period of the eigenfrequency."""
        return max(1, round(1.0 / (self.eigenfrequency * SAMPLE_TIME)))


SWITCHING = {
    'enabled': 'damping is switched on and off by the magnitude',
    'always': 'damping goes on one period after activation and never off, whatever the magnitude',
}
"""Values of `switching`, and what they mean."""


RUN_TIME = frozenset(
    {
        'switching',
        'eigenfrequency',
        'quality',
        'lead_time',
        'switch_on_level',
        'switch_off_level',
        'damper',
    }
)
"""Parameters that the configured controller takes, active from the next sample on."""


def checked_parameters(parameters: ControlParameters) -> ControlParameters:
    """Return the parameters checked one by one and against each other, or raise `ParameterError`."""
    parameters = checked(parameters)
    if parameters.switching not in SWITCHING:
        raise ParameterError(
            f'switching {parameters.switching!r} is unknown; known are {", ".join(SWITCHING)}'
        )
    if not parameters.switch_off_level < parameters.switch_on_level:
        raise ParameterError(
            f'switch_off_level ({1e3 * parameters.switch_off_level:g} mm) must lie below switch_on_level '
            f'({1e3 * parameters.switch_on_level:g} mm), else damping switches on and off at every period'
        )
    lead_phase = 2.0 * math.pi * parameters.eigenfrequency * parameters.lead_time
    if lead_phase > 0.25 * math.pi:
        raise ParameterError(
            f'lead_time ({1e3 * parameters.lead_time:g} ms) must stay below an eighth of a period '
            f'({125.0 / parameters.eigenfrequency:.3g} ms at {parameters.eigenfrequency:g} Hz); '
            'a longer delay cannot be predicted'
        )
    return parameters
