"""The answer of the contact to a ramp of the rack's position control, and its springs and damper from that.

The rack's position control acts like a spring p between desired displacement x_d and displacement x, in
series with c_Re and with c_R parallel to d_R. After a step X of x_d (derived; Eq (10) is printed without the
"1 -" in the bracket):

    c_xi = c_Re c_R / (c_Re + c_R) = F(inf) / x(inf)              K = X p / (p + c_xi)
    x(t) = K [1 - (1 - kappa) exp(-t/T)]                          kappa = T_v / T = x(0+) / x(inf)
    T = d_R / (c_R + p c_Re / (p + c_Re))                         T_v = d_R / (c_Re + c_R)

    c_Re = (p + c_xi) / kappa - p;  c_R = c_xi c_Re / (c_Re - c_xi);  d_R = T (c_R + p c_Re / (p + c_Re))

A real ramp lasts t_r; its response is the mean of the step response over the last t_r, in closed form.
"""

from dataclasses import dataclass

import numpy as np

from engine_mount.identification.friction.recording import FloatArray
from mount_models.friction.contact import FrictionContact


@dataclass(frozen=True)
class PrintedFormulas:
    """What Eqs (10), (11) give as they are printed, N/m and N s/m, under both readings of c_xi.

    The print leaves open whether c_xi contains the spring p: for c_Re it must (k is then F(0+) / F(inf)), for
    c_R it must not. d_R = c_R T neglects p beside c_R.
    """

    contact_stiffness: float
    tangential_stiffness_with_p: float
    tangential_stiffness_without_p: float
    tangential_damping: float


def contact_of_response(
    joint_stiffness: float, machine_stiffness: float, kappa: float, time_constant: float
) -> FrictionContact:
    """Return the contact from c_xi, p (N/m), kappa = T_v / T and T (s): Eq (11) put right (derived)."""
    c_re = (machine_stiffness + joint_stiffness) / kappa - machine_stiffness
    c_r = joint_stiffness * c_re / (c_re - joint_stiffness)
    d_r = time_constant * (c_r + machine_stiffness * c_re / (machine_stiffness + c_re))
    return FrictionContact(c_r, d_r, c_re)


def printed_formulas(
    joint_stiffness: float,
    stiffness_with_p: float,
    machine_stiffness: float,
    first_over_last: float,
    time_constant: float,
) -> PrintedFormulas:
    """Return Eq (11) word for word, k being the first force over the last.

    `joint_stiffness` is c_xi without the spring p, `stiffness_with_p` (the last force over the desired
    displacement) contains it; N/m, T in s.
    """
    k, p = first_over_last, machine_stiffness
    c_re = k * stiffness_with_p * p / (p - k * stiffness_with_p)
    without_p = joint_stiffness * c_re / (c_re - joint_stiffness)
    with_p = stiffness_with_p * c_re / (c_re - stiffness_with_p)
    return PrintedFormulas(c_re, with_p, without_p, without_p * time_constant)


def ramp_response(
    contact: FrictionContact,
    machine_stiffness: float,
    desired: float,
    start: float,
    ramp: float,
    time: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (x, F, x_d) of a ramp of x_d to `desired` (m) in `ramp` s from `start` s, in closed form."""
    c_re, c_r, d_r, p = (
        contact.contact_stiffness,
        contact.tangential_stiffness,
        contact.tangential_damping,
        (machine_stiffness),
    )
    c_xi = c_re * c_r / (c_re + c_r)
    lag = d_r / (c_r + p * c_re / (p + c_re))
    kappa = d_r / (c_re + c_r) / lag
    asymptote = desired * p / (p + c_xi)
    return response(np.array([asymptote, kappa, lag, p, desired, start, ramp]), time)


def response(values: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (x, F, x_d) at `time` (s); `values` are K (m), kappa, T (s), p (N/m), X (m), start, t_r."""
    asymptote, kappa, lag, stiffness, desired, start, ramp = values
    since = np.maximum(time - start, 0.0)
    rise = np.minimum(since / ramp, 1.0)
    # mean of exp(-s/T) over the part of the ramp that has happened, times that part
    fading = (lag / ramp) * (np.exp(-np.maximum(since - ramp, 0.0) / lag) - np.exp(-since / lag))
    x = asymptote * (rise - (1.0 - kappa) * fading)
    return x, stiffness * (desired * rise - x), desired * rise


def inverted(values: FloatArray) -> FrictionContact:
    """Return the contact that answers with these `values`, as `response` takes them."""
    asymptote, kappa, lag, p, desired = (float(value) for value in values[:5])
    return contact_of_response(p * (desired - asymptote) / asymptote, p, kappa, lag)


def as_printed(values: FloatArray) -> PrintedFormulas:
    """Return what the printed Eq (11) makes of these `values`, as `response` takes them."""
    asymptote, kappa, lag, p, desired = (float(value) for value in values[:5])
    joint = p * (desired - asymptote) / asymptote
    first_over_last = (desired - kappa * asymptote) / (desired - asymptote)
    return printed_formulas(joint, joint * p / (joint + p), p, first_over_last, lag)
