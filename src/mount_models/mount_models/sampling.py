"""What the electronics and those who answer them have agreed on, as `mount.dbc` says.

The sample rate is one parameter of the whole graph: every node has it as `sample_rate`, and what counts
samples is made for it. The constants are the default alone.
"""

from typing import Annotated

from mount_models.quantity import ParameterError, Quantity

SAMPLE_RATE = 1000.0  # Hz, chosen: how often the electronics measure and are answered, unless set otherwise
SAMPLE_TIME = 1.0 / SAMPLE_RATE  # s
SAMPLE_TIME_NS = round(1e9 * SAMPLE_TIME)

LOWEST_SAMPLE_RATE = 500.0  # Hz, chosen: twenty-five times the 20 Hz up to which an engine moves
HIGHEST_SAMPLE_RATE = 2000.0  # Hz, chosen: Python answers in less than 0.5 ms

SampleRate = Annotated[
    float,
    Quantity(
        'Hz',
        'how often the electronics measure and are answered, the same in the whole graph',
        LOWEST_SAMPLE_RATE,
        HIGHEST_SAMPLE_RATE,
        'chosen',
    ),
]
"""The type of the parameter `sample_rate` of every node."""

HIGHEST_CURRENT = 3.0  # A, section 3.2: of the coil, wherever a current passes
SETPOINT_TIMEOUT = 0.020  # s, chosen: greatest age of the sample that a current answers; then 0 A


def sample_time_ns(sample_rate: float) -> int:
    """Return the time between two samples in ns for a rate in Hz.

    Raises `ParameterError` unless it is a whole number of microseconds, in which the electronics count.
    """
    microseconds = round(1e6 / sample_rate)
    if 1e6 / sample_rate != microseconds:
        raise ParameterError(
            f'sample_rate ({sample_rate:g} Hz) must divide 1 000 000, for the electronics count the time in '
            f'whole microseconds; near it lies {1e6 / microseconds:.6g} Hz'
        )
    return 1000 * microseconds
