"""The friction rack: a linear motor moves the pads on the rod at constant normal force; nothing else acts.

The pads are the full model; the motor's position control is the spring p of Fig. 6.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.full import full_response
from mount_ros.topics import SAMPLE_RATE

FloatArray = npt.NDArray[np.float64]

STEP_TIME = 1e-4
"""Step of the simulation in s (chosen): ten for each sample."""
_STEPS = round(1.0 / (SAMPLE_RATE * STEP_TIME))


class RackSamples(NamedTuple):
    """What the rack's instruments read at 1 kHz, all of shape (n,): m, N, N."""

    displacement: FloatArray
    friction_force: FloatArray
    normal_force: FloatArray


def move(
    contact: FrictionContact,
    coefs: FrictionCoefficients,
    corner_times: npt.ArrayLike,
    corner_positions: npt.ArrayLike,
    normal_force: float,
    *,
    motor_stiffness: float = np.inf,
    force_noise: float = 0.0,
    displacement_noise: float = 0.0,
    seed: int = 0,
) -> RackSamples:
    """Return what is measured while the wanted displacement (m) goes straight from corner to corner (s).

    `motor_stiffness` p (N/m) lies in series with the contact's own spring c_Re, so both make one spring
    between wanted displacement and creeping element; the displacement itself lacks what p gives way (exact).
    `force_noise` (N) and `displacement_noise` (m) are the standard deviations of the instruments.
    """
    times = np.asarray(corner_times, float)
    wanted = np.interp(np.arange(0.0, times[-1], STEP_TIME), times, np.asarray(corner_positions, float))
    stiffness = 1.0 / (1.0 / contact.contact_stiffness + 1.0 / motor_stiffness)
    in_series = contact._replace(contact_stiffness=stiffness)
    force, _, _ = full_response(in_series, coefs, wanted, np.full(wanted.size, normal_force), STEP_TIME)
    displacement = (wanted - force / motor_stiffness)[::_STEPS]
    noise = np.random.default_rng(seed).standard_normal((2, displacement.size))
    return RackSamples(
        displacement + displacement_noise * noise[0],
        force[::_STEPS] + force_noise * noise[1],
        np.full(displacement.size, normal_force),
    )


def full_model_force(
    contact: FrictionContact, coefs: FrictionCoefficients, displacement: FloatArray, normal_force: FloatArray
) -> FloatArray:
    """Return the force (N) of the full model on a displacement (m) sampled at 1 kHz, straight between "
    "samples."""
    samples = np.arange(displacement.size) / SAMPLE_RATE
    time = np.arange((displacement.size - 1) * _STEPS + 1) * STEP_TIME
    x, load = np.interp(time, samples, displacement), np.interp(time, samples, normal_force)
    return np.asarray(full_response(contact, coefs, x, load, STEP_TIME)[0][::_STEPS], np.float64)


def sawtooth_corners(
    amplitude: float, lowest_speed: float, highest_speed: float, speed_step: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (s) and positions (m) of the corners, and the speed (m/s) of each stroke between them.

    From the middle to one end at the lowest speed; then stroke by stroke from end to end, faster by
    `speed_step` after every second turning point.
    """
    speeds = np.arange(lowest_speed, highest_speed + 0.5 * speed_step, speed_step)
    strokes = np.concatenate([[lowest_speed], np.repeat(speeds, 2)])
    ways = np.concatenate([[amplitude], np.full(strokes.size - 1, 2.0 * amplitude)])
    times = np.concatenate([[0.0], np.cumsum(ways / strokes)])
    ends = amplitude * np.where(np.arange(strokes.size) % 2 == 0, -1.0, 1.0)
    return times, np.concatenate([[0.0], ends]), strokes
