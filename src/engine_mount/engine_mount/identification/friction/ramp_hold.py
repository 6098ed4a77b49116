"""Step 1: springs and damper of the contact from ramp and hold in microslip (Fig. 7, Eqs 10, 11).

The rack's position control acts like a spring p between desired displacement x_d and displacement x, in
series with c_Re and with c_R parallel to d_R. After a step X of x_d (derived; Eq (10) is printed without the
"1 -" in the bracket):

    c_xi = c_Re c_R / (c_Re + c_R) = F(inf) / x(inf)              K = X p / (p + c_xi)
    x(t) = K [1 - (1 - kappa) exp(-t/T)]                          kappa = T_v / T = x(0+) / x(inf)
    T = d_R / (c_R + p c_Re / (p + c_Re))                         T_v = d_R / (c_Re + c_R)

    c_Re = (p + c_xi) / kappa - p;  c_R = c_xi c_Re / (c_Re - c_xi);  d_R = T (c_R + p c_Re / (p + c_Re))

A real ramp lasts t_r; its response is the mean of the step response over the last t_r, in closed form. All of
x, F and, where recorded, x_d are fitted at once, so neither the beginning nor the end of the ramp is needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import approx_fprime, least_squares
from scipy.signal import savgol_filter

from engine_mount.identification.fitting import (
    FloatArray,
    IdentificationError,
    covariance_of,
    rms,
    single_threaded,
)
from engine_mount.identification.friction.recording import FrictionRecording
from mount_models.friction.contact import FrictionContact

LARGEST_MISFIT = 0.08
"""Largest rms misfit over the rms of force or displacement: above, it is no ramp in microslip (chosen)."""
LARGEST_UNCERTAINTY = 0.25
SHORTEST_HOLD = 3.0
"""Time constants (chosen): 5 % of the creep is left then, so its end is measured, not extrapolated."""
_LOW = np.array([1e-3, 0.02, 1e-3, 1e-4, 1e-3, -np.inf, 1e-3, -1.0, -1.0, -1.0])
_HIGH = np.array([1e3, 1.999, 1e3, 1e4, 1e3, np.inf, 1e3, 1.0, 1.0, 1.0])


class RampResponse(NamedTuple):
    """What determines x, F and x_d: K (m), kappa, T (s), p (N/m), X (m), start and length t_r (s)."""

    asymptote: float
    kappa: float
    time_constant: float
    machine_stiffness: float
    desired: float
    ramp_start: float
    ramp_time: float

    def contact(self) -> FrictionContact:
        """Return the contact with this response."""
        joint_stiffness = self.machine_stiffness * (self.desired - self.asymptote) / self.asymptote
        return contact_of_response(joint_stiffness, self.machine_stiffness, self.kappa, self.time_constant)

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (x, F, x_d) at `time` (s)."""
        since = np.maximum(time - self.ramp_start, 0.0)
        rise = np.minimum(since / self.ramp_time, 1.0)
        lag = self.time_constant
        # mean of exp(-s/T) over the part of the ramp that has happened, times that part
        behind = np.exp(-np.maximum(since - self.ramp_time, 0.0) / lag)
        fading = (lag / self.ramp_time) * (behind - np.exp(-since / lag))
        x = self.asymptote * (rise - (1.0 - self.kappa) * fading)
        return x, self.machine_stiffness * (self.desired * rise - x), self.desired * rise


@dataclass(frozen=True)
class RampHoldFit:
    """Result of step 1: `contact`, its standard deviations and covariance (3, 3), and the fitted response.

    `displacement_misfit` and `force_misfit` are rms residual over rms signal; `displacement` (m) and `force`
    (N), (n,), are the fit.
    """

    recording: FrictionRecording
    contact: FrictionContact
    deviation: FrictionContact
    covariance: FloatArray
    response: RampResponse
    displacement_misfit: float
    force_misfit: float
    displacement: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class Relaxation:
    """x(t) = asymptote - amplitude exp(-t/T), t from the start of the ramp; m, m, s."""

    asymptote: float
    amplitude: float
    time_constant: float

    def at(self, time: FloatArray) -> FloatArray:
        """Return the displacement (m) at `time` (s)."""
        return self.asymptote - self.amplitude * np.exp(-time / self.time_constant)

    def kappa(self, ramp_time: float) -> float:
        """Return T_v / T of a ramp of `ramp_time` (s).

        A ramp leaves a larger amplitude than the step that Eq (10) is about, whose ramp time is 0 (derived).
        """
        share = self.amplitude / self.asymptote
        if ramp_time > 0.0:
            ratio = ramp_time / self.time_constant
            share *= float(ratio / np.expm1(ratio))
        return 1.0 - share


def contact_of_response(
    joint_stiffness: float, machine_stiffness: float, kappa: float, time_constant: float
) -> FrictionContact:
    """Return the contact from c_xi, p (N/m), kappa = T_v / T and T (s): Eq (11) put right (derived)."""
    c_re = (machine_stiffness + joint_stiffness) / kappa - machine_stiffness
    c_r = joint_stiffness * c_re / (c_re - joint_stiffness)
    d_r = time_constant * (c_r + machine_stiffness * c_re / (machine_stiffness + c_re))
    return FrictionContact(c_r, d_r, c_re)


def printed_formulas(c_xi: float, p: float, k: float, time_constant: float) -> FrictionContact:
    """Return the contact by Eq (11) word for word, `k` being the first force over the last; N/m, T in s.

    The print leaves open whether `c_xi` contains the spring `p`: for c_Re it must (force over the desired
    displacement), for c_R it must not. d_R = c_R T neglects p beside c_R.
    """
    c_re = k * c_xi * p / (p - k * c_xi)
    c_r = c_xi * c_re / (c_re - c_xi)
    return FrictionContact(c_r, c_r * time_constant, c_re)


def fit_relaxation(time: FloatArray, displacement: FloatArray, fit_from: float) -> Relaxation:
    """Return Eq (10) by itself, as the authors fitted it: the relaxation (m) from `fit_from` (s) on."""
    shown = time >= fit_from
    t, x = time[shown], displacement[shown]
    scale = abs(x[-1])

    def error(unknown: FloatArray) -> FloatArray:
        return unknown[0] - unknown[1] * np.exp(-t / unknown[2]) - x / scale

    found = least_squares(error, (1.0, 0.2, 0.2 * t[-1]), bounds=((-10, -10, 1e-3), (10, 10, 100))).x
    return Relaxation(float(found[0]) * scale, float(found[1]) * scale, float(found[2]))


@single_threaded
def fit_ramp_hold(recording: FrictionRecording) -> RampHoldFit:
    """Return the contact's springs and damper; raises `IdentificationError` where the ramp shows none."""
    name, time = recording.name, recording.time
    sign = 1.0 if recording.force[-recording.force.size // 4 :].mean() >= 0.0 else -1.0
    zeros = [_first_level(each) for each in (recording.displacement, recording.force)]
    x, force = sign * (recording.displacement - zeros[0]), sign * (recording.force - zeros[1])
    desired = recording.desired_displacement
    if desired is not None:
        desired = sign * (desired - _first_level(desired))
    first = _start(name, time, x, force, desired)
    # the last three unknowns are what is left of the zeros of the three channels
    start = np.array([*first, 0.0, 0.0, 0.0])
    scale = np.array([*first, first.asymptote, first.machine_stiffness * first.asymptote, first.asymptote])
    scale[1], scale[5] = 0.5, first.ramp_time
    noise = _noise(x), _noise(force), 1.0 if desired is None else _noise(desired)

    def residuals(unknowns: FloatArray) -> FloatArray:
        values = unknowns * scale
        model = RampResponse(*values[:7]).at(time)
        # without x_d its zero has nothing to hold it
        last = values[9:] / scale[9] if desired is None else (model[2] + values[9] - desired) / noise[2]
        return np.concatenate(
            [(model[0] + values[7] - x) / noise[0], (model[1] + values[8] - force) / noise[1], last]
        )

    fit = least_squares(
        residuals, np.clip(start / scale, _LOW, _HIGH), bounds=(_LOW, _HIGH), x_scale='jac', ftol=1e-12,
        xtol=1e-12, gtol=1e-12, max_nfev=100,
    )  # fmt: skip
    *found, zero_x, zero_force, _ = (fit.x * scale).tolist()
    response = RampResponse(*found)
    model = response.at(time)
    model_x, model_force = model[0] + zero_x, model[1] + zero_force
    misfits = rms(model_x - x) / rms(x), rms(model_force - force) / rms(force)
    _check_response(name, response, misfits, time[-1])
    contact = response.contact()
    covariance = _contact_covariance(response, (covariance_of(fit) * np.outer(scale, scale))[:7, :7])
    deviation = FrictionContact(*np.sqrt(covariance.diagonal().clip(0.0)).tolist())
    for quantity, value, spread in zip(('c_R', 'd_R', 'c_Re'), contact, deviation, strict=True):
        if spread > LARGEST_UNCERTAINTY * value:
            raise IdentificationError(
                f'{name}: {quantity} {value:.3g} is known only to {spread:.2g} (at most '
                f'{LARGEST_UNCERTAINTY:.0%}): hold longer, or reduce noise'
            )
    fitted = sign * model_x + zeros[0], sign * model_force + zeros[1]
    return RampHoldFit(recording, contact, deviation, covariance, response, *misfits, *fitted)


def mean_contact(fits: Sequence[RampHoldFit]) -> tuple[FrictionContact, FloatArray]:
    """Return each parameter's mean over several ramps, weighted by its uncertainty, and their covariance."""
    values = np.array([fit.contact for fit in fits])
    weights = 1.0 / np.maximum(np.array([fit.deviation for fit in fits]), 1e-9 * values) ** 2
    shares = weights / weights.sum(axis=0)
    covariances = np.array([fit.covariance for fit in fits])
    covariance = np.einsum('ni,nj,nij->ij', shares, shares, covariances)
    return FrictionContact(*(values * shares).sum(axis=0).tolist()), covariance


def _start(
    name: str, time: FloatArray, x: FloatArray, force: FloatArray, desired: FloatArray | None
) -> RampResponse:
    """Return a first response from the shape of force and displacement."""
    count, step = x.size, time[1] - time[0]
    width = max(5, (count // 200) | 1)
    smooth_force, smooth_x = savgol_filter(force, width, 1), savgol_filter(x, width, 1)
    top = int(np.argmax(smooth_force))
    tail = slice(int(0.9 * count), None)
    force_end, x_end = float(np.median(force[tail])), float(np.median(x[tail]))
    rising = np.flatnonzero(smooth_force[: top + 1] > 0.1 * smooth_force[top])
    if force_end <= 0.0 or x_end <= 0.0 or top < 2 or not rising.size or top > 0.8 * count:
        raise IdentificationError(
            f'{name}: force ends at {force_end:.3g} N and displacement at {x_end:.3g} m; step 1 needs a ramp '
            'that is held afterwards, force and displacement to the same side: check signs, or record ramp '
            'and hold'
        )
    begin = int(rising[0])
    ramp = max(time[top] - time[begin], 2.0 * step) * 1.1
    hold = slice(min(top + max(1, (top - begin) // 10), count - 10), None)
    if desired is not None:
        gap = (desired - x)[hold]
        stiffness = gap @ force[hold] / (gap @ gap)
    else:
        stiffness = -np.polyfit(smooth_x[hold], smooth_force[hold], 1)[0]
    if not stiffness > 0.0:
        raise IdentificationError(
            f'{name}: while held, force and displacement change by {stiffness:.3g} N/m together; a rack '
            'gives way against the force (above 0 N/m): record the desired displacement as well, or hold '
            'longer'
        )
    held = smooth_x[hold]
    height = np.clip(held[0] / x_end, 0.1, 0.98)
    passed = (held - held[0]) > 0.63 * (x_end - held[0])
    lag = max(time[hold][np.argmax(passed)] - time[hold][0], 4.0 * step)
    total = x_end + force_end / stiffness
    return RampResponse(x_end, height, lag, stiffness, total, time[begin] - 0.1 * ramp, ramp)


def _check_response(name: str, response: RampResponse, misfits: tuple[float, float], end: float) -> None:
    for channel, misfit in zip(('displacement', 'force'), misfits, strict=True):
        if misfit > LARGEST_MISFIT:
            raise IdentificationError(
                f'{name}: the fitted ramp misses the {channel} by {100 * misfit:.1f} % rms (at most '
                f'{100 * LARGEST_MISFIT:.0f} %): the contact slides, or it is no ramp that is held; use a '
                'smaller displacement'
            )
    c_r, d_r, c_re = response.contact()
    if not all(value > 0.0 and np.isfinite(value) for value in (c_r, d_r, c_re)):
        raise IdentificationError(
            f'{name}: c_R {c_r:.3g} N/m, d_R {d_r:.3g} N s/m, c_Re {c_re:.3g} N/m must all be above 0: the '
            f'displacement does not creep as the contact does (kappa {response.kappa:.3f} must lie below 1); '
            'ramp faster, hold longer, and stay in microslip'
        )
    held, lag = end - response.ramp_start - response.ramp_time, response.time_constant
    if held < SHORTEST_HOLD * lag:
        raise IdentificationError(
            f'{name}: the ramp is held for {held:.2f} s, {held / lag:.1f} time constants of {lag:.2f} s (at '
            f'least {SHORTEST_HOLD:g}): where the creep ends is not measured; hold for '
            f'{SHORTEST_HOLD * lag:.1f} s or longer'
        )


def _contact_covariance(response: RampResponse, covariance: FloatArray) -> FloatArray:
    """Return the covariance (3, 3) of c_R, d_R, c_Re by linear propagation."""
    values = np.array(response)
    slopes = approx_fprime(values, lambda each: RampResponse(*each).contact(), 1e-7 * np.abs(values) + 1e-30)
    return slopes @ covariance @ slopes.T


def _first_level(values: FloatArray) -> float:
    """Return a first guess of a channel's zero; the fit corrects it."""
    return float(values[: max(1, min(5, values.size // 100))].mean())


def _noise(values: FloatArray) -> float:
    """Return the noise of a channel; of a channel without noise, a thousandth of its range."""
    noise = float(np.median(np.abs(np.diff(values, 2)))) / (0.6745 * np.sqrt(6.0))
    return max(noise, 1e-3 * np.ptp(values))
