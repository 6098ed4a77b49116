"""Step 1: springs and damper of the contact from ramp and hold in microslip (Fig. 7, Eqs 10, 11).

The formulas are those of `ramp_response`. All of x, F and, where recorded, x_d are fitted at once, so neither
the beginning nor the end of the ramp is told.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from engine_mount.identification.friction.recording import (
    FloatArray,
    FrictionRecording,
    IdentificationError,
)
from engine_mount.identification.friction.steps.ramp_response import (
    PrintedFormulas,
    as_printed,
    inverted,
    response,
)
from engine_mount.identification.single_threaded import single_threaded
from mount_models.friction.contact import FrictionContact

LARGEST_MISFIT = 0.08
"""Largest rms misfit over the rms of force or displacement: above, it is no ramp in microslip (chosen)."""
LARGEST_UNCERTAINTY = 0.25
SHORTEST_HOLD = 3.0
"""Time constants (chosen): 5 % of the creep is left then, so its end is measured, not extrapolated."""


@dataclass(frozen=True)
class RampHoldFit:
    """Result of step 1: `contact`, its standard deviations and covariance, and all fitted on the way.

    `machine_stiffness` is p in N/m; `time_constant` T, `ramp_start`, `ramp_time` in s; `asymptote` K and
    `desired` X in m; `kappa` = T_v / T. `printed` is what the printed formulas make of the same numbers.
    `displacement_misfit` and `force_misfit` are rms residual over rms signal.
    """

    name: str
    contact: FrictionContact
    deviation: FrictionContact
    covariance: FloatArray
    machine_stiffness: float
    kappa: float
    time_constant: float
    asymptote: float
    desired: float
    ramp_start: float
    ramp_time: float
    printed: PrintedFormulas
    displacement_misfit: float
    force_misfit: float
    displacement: FloatArray
    force: FloatArray


@single_threaded
def fit_ramp_hold(recording: FrictionRecording) -> RampHoldFit:
    """Return the contact's springs and damper; raises `IdentificationError` where the ramp does not tell."""
    time = recording.time
    sign = 1.0 if recording.force[-recording.force.size // 4 :].mean() >= 0.0 else -1.0
    zero_x, zero_force = _first_level(recording.displacement), _first_level(recording.force)
    x = sign * (recording.displacement - zero_x)
    force = sign * (recording.force - zero_force)
    asked = recording.desired_displacement
    desired = None if asked is None else sign * (asked - _first_level(asked))
    start = _start(recording.name, time, x, force, desired)
    # the last three unknowns are what is left of the zeros of the three channels
    start = np.concatenate([start, np.zeros(3)])
    scale = np.array([start[0], 0.5, start[2], start[3], start[4], start[6], start[6], *start[[0, 0, 0]]])
    scale[8] = start[3] * start[0]
    noise = _noise(x), _noise(force), 1.0 if desired is None else _noise(desired)

    def residuals(unknowns: FloatArray) -> FloatArray:
        values = unknowns * scale
        model = response(values[:7], time)
        parts = [(model[0] + values[7] - x) / noise[0], (model[1] + values[8] - force) / noise[1]]
        # without x_d its zero has nothing to hold it
        parts.append(
            (model[2] + values[9] - desired) / noise[2] if desired is not None else values[9:] / scale[9]
        )
        return np.concatenate(parts)

    low = np.array([1e-3, 0.02, 1e-3, 1e-4, 1e-3, -np.inf, 1e-3, -1.0, -1.0, -1.0])
    high = np.array([1e3, 1.999, 1e3, 1e4, 1e3, np.inf, 1e3, 1.0, 1.0, 1.0])
    found = least_squares(
        residuals, np.clip(start / scale, low, high), bounds=(low, high), x_scale='jac', ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12, max_nfev=100,
    )  # fmt: skip
    values = found.x * scale
    covariance = (_covariance(found.jac, found.fun) * np.outer(scale, scale))[:7, :7]
    model = response(values[:7], time)
    model = model[0] + values[7], model[1] + values[8], model[2]
    values = values[:7]
    misfits = _relative(model[0] - x, x), _relative(model[1] - force, force)
    _check_misfit(recording.name, misfits)
    contact = _contact(recording.name, values)
    _check_hold(recording.name, float(time[-1] - values[5] - values[6]), float(values[2]))
    covariance = _contact_covariance(values, covariance)
    deviation = FrictionContact(*(float(value) for value in np.sqrt(covariance.diagonal().clip(0.0))))
    _check_deviation(recording.name, contact, deviation)
    return RampHoldFit(
        name=recording.name,
        contact=contact,
        deviation=deviation,
        covariance=covariance,
        machine_stiffness=float(values[3]),
        kappa=float(values[1]),
        time_constant=float(values[2]),
        asymptote=float(sign * values[0]),
        desired=float(sign * values[4]),
        ramp_start=float(values[5]),
        ramp_time=float(values[6]),
        printed=as_printed(values),
        displacement_misfit=misfits[0],
        force_misfit=misfits[1],
        displacement=sign * model[0] + zero_x,
        force=sign * model[1] + zero_force,
    )


def mean_contact(fits: list[RampHoldFit]) -> FrictionContact:
    """Return the contact of several ramps: each parameter's mean, weighted by its uncertainty."""
    values = np.array([fit.contact for fit in fits])
    weights = 1.0 / np.maximum(np.array([fit.deviation for fit in fits]), 1e-9 * values) ** 2
    return FrictionContact(*(float(value) for value in (values * weights).sum(axis=0) / weights.sum(axis=0)))


def mean_covariance(fits: list[RampHoldFit]) -> FloatArray:
    """Return the covariance (3, 3) of `mean_contact`, whose weights are those of single parameters."""
    weights = 1.0 / np.maximum(np.array([fit.covariance.diagonal() for fit in fits]), 1e-300)
    shares = weights / weights.sum(axis=0)
    parts = [np.outer(share, share) * fit.covariance for share, fit in zip(shares, fits, strict=True)]
    return np.asarray(sum(parts))


def _start(
    name: str, time: FloatArray, x: FloatArray, force: FloatArray, desired: FloatArray | None
) -> FloatArray:
    """Return first values of all unknowns from the shape of force and displacement."""
    count = x.size
    width = max(5, (count // 200) | 1)
    smooth_force = savgol_filter(force, width, 1)
    smooth_x = savgol_filter(x, width, 1)
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
    ramp = max(time[top] - time[begin], 2.0 * (time[1] - time[0])) * 1.1
    hold = slice(min(top + max(1, (top - begin) // 10), count - 10), None)
    if desired is not None:
        gap = (desired - x)[hold]
        stiffness = float(gap @ force[hold] / (gap @ gap))
    else:
        stiffness = -float(np.polyfit(smooth_x[hold], smooth_force[hold], 1)[0])
    if not stiffness > 0.0:
        raise IdentificationError(
            f'{name}: while held, force and displacement change by {stiffness:.3g} N/m together; a rack '
            'gives way against the force (above 0 N/m): record the desired displacement as well, or hold '
            'longer'
        )
    height = np.clip(smooth_x[hold][0] / x_end, 0.1, 0.98)
    passed = (smooth_x[hold] - smooth_x[hold][0]) > 0.63 * (x_end - smooth_x[hold][0])
    lag = max(float(time[hold][np.argmax(passed)] - time[hold][0]), 4.0 * (time[1] - time[0]))
    total = x_end + force_end / stiffness
    return np.array([x_end, height, lag, stiffness, total, time[begin] - 0.1 * ramp, ramp])


def _contact(name: str, values: FloatArray) -> FrictionContact:
    contact = inverted(values)
    if not all(value > 0.0 and np.isfinite(value) for value in contact):
        raise IdentificationError(
            f'{name}: c_R {contact.tangential_stiffness:.3g} N/m, d_R {contact.tangential_damping:.3g} N '
            f's/m, c_Re {contact.contact_stiffness:.3g} N/m must all be above 0: the displacement does not '
            f'creep as the contact does (kappa {values[1]:.3f} must lie below 1); ramp faster, hold longer, '
            'and stay in microslip'
        )
    return contact


def _contact_covariance(values: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the covariance (3, 3) of c_R, d_R, c_Re by linear propagation."""
    slopes = np.zeros((3, values.size))
    for place in range(5):
        step = 1e-6 * abs(values[place])
        up, down = values.copy(), values.copy()
        up[place] += step
        down[place] -= step
        slopes[:, place] = (np.array(inverted(up)) - np.array(inverted(down))) / (2.0 * step)
    return np.asarray(slopes @ covariance @ slopes.T)


def _check_misfit(name: str, misfits: tuple[float, float]) -> None:
    for channel, misfit in zip(('displacement', 'force'), misfits, strict=True):
        if misfit > LARGEST_MISFIT:
            raise IdentificationError(
                f'{name}: the fitted ramp misses the {channel} by {100 * misfit:.1f} % rms (at most '
                f'{100 * LARGEST_MISFIT:.0f} %): the contact slides, or it is no ramp that is held; use a '
                'smaller displacement'
            )


def _check_hold(name: str, held: float, lag: float) -> None:
    if held < SHORTEST_HOLD * lag:
        raise IdentificationError(
            f'{name}: the ramp is held for {held:.2f} s, {held / lag:.1f} time constants of {lag:.2f} s (at '
            f'least {SHORTEST_HOLD:g}): where the creep ends is not measured; hold for '
            f'{SHORTEST_HOLD * lag:.1f} s or longer'
        )


def _check_deviation(name: str, contact: FrictionContact, deviation: FrictionContact) -> None:
    for quantity, value, spread in zip(('c_R', 'd_R', 'c_Re'), contact, deviation, strict=True):
        if spread > LARGEST_UNCERTAINTY * value:
            raise IdentificationError(
                f'{name}: {quantity} {value:.3g} is known only to {spread:.2g} (at most '
                f'{100 * LARGEST_UNCERTAINTY:.0f} %): hold longer, or reduce noise'
            )


def _covariance(jacobian: FloatArray, residuals: FloatArray) -> FloatArray:
    freedom = max(residuals.size - jacobian.shape[1], 1)
    return np.asarray(np.linalg.pinv(jacobian.T @ jacobian) * (residuals @ residuals) / freedom)


def _first_level(values: FloatArray) -> float:
    """Return a first guess of a channel's zero; the fit corrects it."""
    return float(values[: max(1, min(5, values.size // 100))].mean())


def _noise(values: FloatArray) -> float:
    """Return the noise of a channel; of a channel without noise, a thousandth of its range."""
    noise = float(np.median(np.abs(np.diff(values, 2)))) / (0.6745 * np.sqrt(6.0))
    return max(noise, 1e-3 * float(np.ptp(values)))


def _relative(error: FloatArray, signal: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2) / np.mean(signal**2)))
