"""The delay of the loop: from a sample to the middle of the effect of its setpoint."""

from mount_models.sampling import SAMPLE_TIME

LOOP_DELAY = 0.0019
"""s at 1 kHz (derived): 1 ms until the electronics take a setpoint over, 0.5 ms half its hold, 0.4 ms their
current loop of 400 Hz."""
_SAMPLES = 1.5  # of it that follow the sample rate: until the setpoint is taken over, and half its hold


def delay_at(delay: float, sample_time: float) -> float:
    """Return a delay (s), given at 1 kHz, where samples come `sample_time` s apart; never below 0."""
    return max(0.0, delay + _SAMPLES * (sample_time - SAMPLE_TIME))
