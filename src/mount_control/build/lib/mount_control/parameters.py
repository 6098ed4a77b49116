"""What can be set on the controller whatever its policy; each policy has parameters of its own beside it."""

from typing import Annotated, NamedTuple

from mount_control.policy.registry import DEFAULT, POLICIES
from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SampleRate


class ControlParameters(NamedTuple):
    """Name of the policy, rate of the samples, what is believed of them, and the limit of the output."""

    policy: Annotated[
        str, Quantity('word', 'what decides when and how much is damped', words=tuple(POLICIES))
    ] = DEFAULT
    sample_rate: SampleRate = SAMPLE_RATE
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
    displacement_velocity: Annotated[
        float, Quantity('m/s', 'largest believable velocity of the displacement', 0.1, 100.0, 'chosen')
    ] = 1.0
    displacement_noise: Annotated[
        float, Quantity('m', 'largest believable noise of the displacement', 1e-6, 0.1, 'chosen')
    ] = 5e-5
    displacement_stuck: Annotated[
        float, Quantity('s', 'a noisy displacement that repeats for so long is stuck', 0.01, 10.0, 'chosen')
    ] = 0.05
    highest_current: Annotated[
        float, Quantity('A', 'limit of the setpoint', 0.0, HIGHEST_CURRENT, 'paper, section 3')
    ] = HIGHEST_CURRENT
