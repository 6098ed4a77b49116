"""Whether a displacement can be one: does it move as a mount can, with the noise of a sound sensor?

What no sample tells is not looked for: a reading of wrong sign, unless it jumps there from beyond 0.5 mm, or
one whose zero drifts within the range.
Friction opposes the motion whatever sign it is told, and the band-pass takes drift away.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from mount_control.parameters import ControlParameters
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype

HOLD = 1.0
"""After the last implausible sample none is believed for so long, s; chosen."""

_LEAST_NOISE = 0.5e-6  # m, chosen: five steps of the signal; a sensor with less may well repeat itself
_ORDER = 4  # of the difference that leaves noise and takes motion away: at 50 Hz 1 % of it remains
_NOISE_OF_DIFFERENCE = math.sqrt(70.0 * 2.0 / math.pi)  # mean of |4th difference| of white noise of 1
_SHARE = 10.0  # 1/s, chosen: of each sample in the mean, over about 0.1 s
_CUT = 4.0  # chosen: of the limit; no single reading counts for more


class Doubt(IntEnum):
    """Why a displacement is not believed."""

    NONE = 0
    STEP = 1
    STUCK = 2
    NOISE = 3


class Limits(NamedTuple):
    """What a displacement keeps to: m/s, m; s between samples, share of each in the mean; samples."""

    velocity: float
    noise: float
    sample_time: float
    share: float
    stuck: int
    hold: int


class Known(NamedTuple):
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
MEMORY = record_dtype(Known)


class Plausibility:
    """Keeps what is known of the displacement; `memory` for compiled code, see `doubt_of`."""

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

    def doubt(self, displacement: float, missing: int) -> bool:
        """Take a sample (m) with so many missing before it; return whether it is not to be believed."""
        return bool(doubt_of(self.limits, self.memory, displacement, missing))

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
        told = {
            Doubt.NONE: '',
            Doubt.STEP: (
                f'displacement moved at {value:.2f} m/s (limit {limits.displacement_velocity:g} m/s): '
                'check the displacement sensor, its seat and its cable'
            ),
            Doubt.STUCK: (
                f'displacement repeated {1e3 * value:.4f} mm for {1e3 * limits.displacement_stuck:.0f} ms, '
                f'without the noise of its sensor (limit {1e3 * limits.displacement_stuck:g} ms): '
                'check the displacement sensor'
            ),
            Doubt.NOISE: (
                f'noise of the displacement ({1e6 * value:.0f} um) is above '
                f'{1e6 * limits.displacement_noise:g} um: check the displacement sensor and its shield'
            ),
        }
        return told[Doubt(int(self._record['doubt']))]


_STEP, _STUCK, _NOISE = int(Doubt.STEP), int(Doubt.STUCK), int(Doubt.NOISE)


@compiled
def doubt_of(limits, memory, displacement, missing):
    """Take one displacement (m) with so many `missing` before it; return whether it is in doubt.

    `limits` and `memory` are the bytes of their records. A doubt lasts for `Limits.hold` samples from the
    last reason on. More missing samples than displacements are kept leave nothing to compare with.
    """
    now = _taken(limits.view(LIMITS)[0], _known(memory), displacement, missing)
    _keep(memory, now)
    return now.held > 0


@compiled
def _taken(law, before, displacement, missing):
    """Return what is known after one more displacement (m)."""
    known = min(before.known, 1) if missing > 0 else before.known
    noise, repeats = before.noise, before.repeats
    doubt = max(0, before.held - 1 - missing), before.doubt, before.value
    if known > 0:
        velocity = abs(displacement - before.newest) / ((missing + 1) * law.sample_time)
        if velocity > law.velocity:
            doubt = _raised(law, doubt, _STEP, velocity)
        if displacement == before.newest:
            repeats += 1
            if repeats >= law.stuck and noise >= _LEAST_NOISE:
                doubt = _raised(law, doubt, _STUCK, displacement)
        else:
            repeats = 0
            if known == _ORDER:
                noise += law.share * (_noise(law, before, displacement) - noise)
                if noise > law.noise:
                    doubt = _raised(law, doubt, _NOISE, noise)
    held, reason, value = doubt
    newest = displacement, before.newest, before.second, before.third
    return Known(*newest, noise, value, min(known + 1, _ORDER), repeats, held, reason)


@compiled
def _noise(law, before, displacement):
    """Return the noise (m) that one more displacement tells, no more than a single reading counts for."""
    difference = displacement - 4.0 * (before.newest + before.third) + 6.0 * before.second + before.fourth
    return min(abs(difference) / _NOISE_OF_DIFFERENCE, _CUT * law.noise)


@compiled
def _raised(law, doubt, reason, value):
    """Return (samples for which it is held, reason, value) of a doubt; while one lasts, the first is told."""
    held, told, its_value = doubt
    return (law.hold, told, its_value) if held > 0 else (law.hold, reason, value)


@compiled
def _believed(limits, memory, displacements):
    law, now = limits.view(LIMITS)[0], _known(memory)
    for index in range(len(displacements)):
        after = _taken(law, now, displacements[index], 0)
        if after.held > 0:
            _keep(memory, now)
            return index
        now = after
    _keep(memory, now)
    return len(displacements)


@compiled
def _known(memory):
    """Return what the bytes `memory` hold."""
    now = memory.view(MEMORY)[0]
    displacements = now.newest, now.second, now.third, now.fourth
    return Known(*displacements, now.noise, now.value, now.known, now.repeats, now.held, now.doubt)


@compiled
def _keep(memory, known):
    """Let the bytes `memory` hold what is known."""
    now = memory.view(MEMORY)[0]
    now.newest, now.second, now.third, now.fourth = known.newest, known.second, known.third, known.fourth
    now.noise, now.value, now.known = known.noise, known.value, known.known
    now.repeats, now.held, now.doubt = known.repeats, known.held, known.doubt
