"""Band-pass at the eigenfrequency, velocity in the band, and its prediction over the loop's delay."""

import math
from typing import NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import sine_and_cosine
from mount_models.arithmetic.record import record_type


class BandPass(NamedTuple):
    """Second-order band-pass, bilinear with prewarping, b = (gain, 0, -gain), and its prediction.

    The predicted velocity is `from_velocity` times the band velocity plus `from_displacement` times
    the band displacement.
    """

    gain: float
    a1: float
    a2: float
    sample_time: float
    from_velocity: float
    from_displacement: float


STATE = record_type([('z1', 'f8'), ('z2', 'f8'), ('displacement', 'f8'), ('earlier', 'f8')])
"""Memory of the filter, band displacement (m) of the last sample and of the one before."""


def design(eigenfrequency: float, quality: float, lead_time: float, sample_time: float) -> BandPass:
    """Return the band-pass for an eigenfrequency in Hz that predicts `lead_time` s ahead.

    H(s) = (w0/Q) s / (s^2 + (w0/Q) s + w0^2): gain 1 and phase 0 at the eigenfrequency.
    """
    w0 = 2.0 * math.pi * eigenfrequency
    half_sample = 0.5 * eigenfrequency * sample_time  # turns
    sine, cosine = sine_and_cosine(half_sample)
    warped = sine / cosine  # s becomes (w0 / warped) (z - 1) / (z + 1)
    bandwidth = warped / quality
    scale = 1.0 / (1.0 + bandwidth + warped * warped)
    # A sine A sin(p) has the band velocity A w0 cos(p - f) because the difference of two samples
    # stands half a sample back, f = w0 Ts/2. Wanted is A w0 cos(p + l), l = w0 lead_time.
    lead = float(eigenfrequency * lead_time)  # turns
    return BandPass(
        gain=bandwidth * scale,
        a1=2.0 * (warped * warped - 1.0) * scale,
        a2=(1.0 - bandwidth + warped * warped) * scale,
        sample_time=sample_time,
        from_velocity=sine_and_cosine(lead)[1] / cosine,
        from_displacement=-w0 * sine_and_cosine(lead + half_sample)[0] / cosine,
    )


@compiled
def settle(band_pass, state, displacement):
    """Set the state to that of a mount which has always been at `displacement`."""
    state.z1 = state.z2 = -band_pass.gain * displacement
    state.displacement = state.earlier = 0.0


@compiled
def transfer(old, new, state):
    """Turn the state of the band-pass `old` into one of `new` with the same last samples, in and out.

    So the new difference equation goes on from the old curve: band displacement and velocity have no jump.
    """
    if old.gain == new.gain and old.a1 == new.a1 and old.a2 == new.a2:
        return  # to the bit as it is
    now, before = state.displacement, state.earlier
    # what z1 and z2 hold of the displacement before and now, each times the gain
    share = new.gain / old.gain
    before_in = -share * (state.z1 + old.a1 * now + old.a2 * before)
    now_in = -share * (state.z2 + old.a2 * now)
    state.z1 = -before_in - new.a1 * now - new.a2 * before
    state.z2 = -now_in - new.a2 * now


@compiled
def step(band_pass, state, displacement):
    """Take one sample; return (band displacement m, band velocity m/s, predicted velocity m/s).

    Differentiation and band-pass are linear and may change places: the difference of the filtered
    displacement is the filtered velocity (Fig. 12), with one filter instead of two.
    """
    before = state.displacement
    banded = band_pass.gain * displacement + state.z1  # transposed direct form II
    state.z1 = state.z2 - band_pass.a1 * banded
    state.z2 = -band_pass.gain * displacement - band_pass.a2 * banded
    state.displacement = banded
    state.earlier = before
    velocity = (banded - before) / band_pass.sample_time
    predicted = band_pass.from_velocity * velocity + band_pass.from_displacement * banded
    return banded, velocity, predicted
