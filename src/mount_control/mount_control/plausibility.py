"""Whether a displacement can be one: does it move as a mount can, with the noise of a sound sensor?

A reading of wrong sign, unless it jumps there from beyond 0.5 mm, and a zero that drifts within the range
stay undetected: friction opposes the motion whatever the sign, and the band-pass takes drift away.
"""

import math
from typing import NamedTuple

import numpy as np

from mount_control.settings import ControlParameters
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype

HOLD = 1.0
"""After the last implausible sample none is believed for so long, s; chosen."""

_LEAST_NOISE = 0.5e-6  # m, chosen: five steps of the signal; a sensor with less may well repeat itself
_ORDER = 4  # of the difference that leaves noise and takes motion away: at 50 Hz 1 % of it remains
_NOISE_OF_DIFFERENCE = math.sqrt(70.0 * 2.0 / math.pi)  # mean of |4th difference| of white noise of 1
_SHARE = 10.0  # 1/s, chosen: of each sample in the mean, over about 0.1 s
_CUT = 4.0  # chosen: of the limit; no single reading counts for more


class Limits(NamedTuple):
    """What a displacement keeps to: m/s, m; s between samples, share of each in the mean; samples."""

    velocity: float
    noise: float
    sample_time: float
    share: float
    stuck: int
    hold: int


class History(NamedTuple):
    """The newest displacements (m), how many are `known`, their noise (m); the last doubt and its value."""

    newest: float
    second: float
    third: float
    fourth: float
    noise: float
    value: float
    known: int
    repeats: int
    held: int
    doubt: int


LIMITS = record_dtype(Limits)
MEMORY = record_dtype(History)


class Plausibility:
    """The newest displacements and the verdict on the next one; compiled code calls `doubt_of`."""

    def __init__(self, parameters: ControlParameters):
        self.limits = record_bytes(
            Limits(
                parameters.displacement_velocity,
                parameters.displacement_noise,
                1.0 / parameters.sample_rate,
                _SHARE / parameters.sample_rate,
                round(parameters.displacement_stuck * parameters.sample_rate),
                round(HOLD * parameters.sample_rate),
            )
        )
        self.memory = np.zeros(1, MEMORY).view(np.uint8)
        self._record = self.memory.view(MEMORY)[0]
        self._parameters = parameters

    def believed(self, displacements: np.ndarray) -> int:
        """Take samples that follow each other up to the first that is not to be believed; return how many."""
        return int(_believed(self.limits, self.memory, displacements))

    @property
    def held(self) -> bool:
        """Whether samples are not believed at present."""
        return bool(self._record['held'])

    @property
    def sentence(self) -> str:
        """What was last not believed, with value, limit and remedy; empty where everything was."""
        value, limits = float(self._record['value']), self._parameters
        sentences = (
            '',
            f'displacement moved at {value:.2f} m/s (limit {limits.displacement_velocity:g} m/s): '
            'check the displacement sensor, its seat and its cable',
            f'displacement repeated {1e3 * value:.4f} mm for {1e3 * limits.displacement_stuck:.0f} ms, '
            f'without the noise of its sensor (limit {1e3 * limits.displacement_stuck:g} ms): '
            'check the displacement sensor',
            f'noise of the displacement ({1e6 * value:.0f} um) is above '
            f'{1e6 * limits.displacement_noise:g} um: check the displacement sensor and its shield',
        )
        return sentences[self._record['doubt']]


_NONE, _STEP, _STUCK, _NOISE = range(4)  # why a displacement is not believed


@compiled
def doubt_of(limits, memory, displacement, missing):
    """Take one displacement (m) with so many `missing` before it; return whether it is in doubt.

    `limits` and `memory` are the bytes of their records. A doubt lasts for `Limits.hold` samples from the
    last reason on. More missing samples than displacements are kept leave nothing to compare with.
    """
    law, now = limits.view(LIMITS)[0], memory.view(MEMORY)[0]
    if missing > 0:
        now.known = min(now.known, 1)
    reason, value = _reason(law, now, displacement, missing)
    now.held = max(0, now.held - 1 - missing)
    if reason != _NONE:
        if now.held == 0:  # while a doubt lasts, its first reason stands
            now.doubt, now.value = reason, value
        now.held = law.hold
    now.fourth, now.third, now.second, now.newest = now.third, now.second, now.newest, displacement
    now.known = min(now.known + 1, _ORDER)
    return now.held > 0


@compiled
def _reason(law, now, displacement, missing):
    """Return why one more displacement (m) is not believable, and the value; keeps repeats and noise."""
    reason, value = _NONE, 0.0
    if now.known == 0:
        return reason, value
    velocity = abs(displacement - now.newest) / ((missing + 1) * law.sample_time)
    if velocity > law.velocity:
        reason, value = _STEP, velocity
    if displacement == now.newest:
        now.repeats += 1
        if reason == _NONE and now.repeats >= law.stuck and now.noise >= _LEAST_NOISE:
            reason, value = _STUCK, displacement
        return reason, value
    now.repeats = 0
    if now.known == _ORDER:
        difference = displacement - 4.0 * (now.newest + now.third) + 6.0 * now.second + now.fourth
        noise = min(abs(difference) / _NOISE_OF_DIFFERENCE, _CUT * law.noise)
        now.noise += law.share * (noise - now.noise)
        if reason == _NONE and now.noise > law.noise:
            reason, value = _NOISE, now.noise
    return reason, value


@compiled
def _believed(limits, memory, displacements):
    before = memory.copy()
    for index in range(len(displacements)):
        before[:] = memory
        if doubt_of(limits, memory, displacements[index], 0):
            memory[:] = before
            return index
    return len(displacements)
