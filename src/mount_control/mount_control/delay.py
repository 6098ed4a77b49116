"""The delay of the loop: from a sample to the middle of the effect of its setpoint."""

from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_TIME

LOOP_DELAY = 0.0019
"""s at 1 kHz (derived): 1 ms until the electronics take a setpoint over, 0.5 ms half its hold, 0.4 ms their
current loop of 400 Hz."""
_SAMPLES = 1.5  # of it that follow the sample rate: until the setpoint is taken over, and half its hold


def delay_at(delay: float, sample_time: float) -> float:
    """Return a delay (s), given at 1 kHz, where samples come `sample_time` s apart; never below 0."""
    return max(0.0, delay + _SAMPLES * (sample_time - SAMPLE_TIME))


def check_lead(lead_time: float, eigenfrequency: float) -> None:
    """Raise `ParameterError` for a lead (s) of more than an eighth of a period of the eigenfrequency (Hz)."""
    if eigenfrequency * lead_time > 0.125:
        raise ParameterError(
            f'lead_time ({1e3 * lead_time:g} ms) must stay below an eighth of a period '
            f'({125.0 / eigenfrequency:.3g} ms at {eigenfrequency:g} Hz); a longer delay cannot be predicted'
        )
