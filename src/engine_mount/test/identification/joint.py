"""A slider behind a spring with play, moved to and fro, and its force as a cell with a zero reads it."""

import numpy as np

from engine_mount.identification.friction.recording import checked_recording

DT = 1e-3
TIME = np.arange(0.0, 8.0, DT)


def motion(amplitude, frequency=0.5, rest=0.3):
    """Rest, then a sine that begins at its middle; m."""
    return amplitude * np.sin(2 * np.pi * frequency * np.maximum(TIME - rest, 0.0))


def jenkin(x, limits, stiffness, play, stretch):
    """A slider behind a spring with play, written apart from the one of the package: by its slider."""
    force = np.empty(x.size)
    slider = x[0] - stretch
    for k, place in enumerate(x):
        for sign, limit in zip((1.0, -1.0), limits, strict=True):
            beyond = sign * (place - slider) - play
            if stiffness * beyond > limit:
                slider = place - sign * (play + limit / stiffness)
        out = place - slider
        force[k] = stiffness * np.sign(out) * max(abs(out) - play, 0.0)
    return force


def measured(x, force, zero, seed=0, noise=0.01):
    random = np.random.default_rng(seed)
    force = force + zero + noise * np.sqrt(np.mean(force**2)) * random.standard_normal(force.size)
    return checked_recording('made', TIME, x, force, 1000.0)
