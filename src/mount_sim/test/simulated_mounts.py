"""Simulated mounts by their parameters, and runs of them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mount_models.arithmetic.series import series_of
from mount_models.quantity import flattened, with_flattened
from mount_sim.excitation.building import build_excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import ALONE
from mount_sim.plant.simulated_car import SimulatedCar, SimulatedMount


def parameters(**changes: Any) -> SimParameters:
    """Return parameters with some changed; `bench__amplitude` stands for `bench.amplitude`."""
    return with_flattened(
        SimParameters(), {name.replace('__', '.'): value for name, value in changes.items()}
    )


def make_mount(spoil: Callable[[np.ndarray], None] | None = None, **changes: Any) -> SimulatedMount:
    """Return a simulated mount; by default on the bench for 0.3 s.

    `spoil` changes the numbers that shake it, in their place.
    """
    defaults = {'scenario': 'bench', 'timeline__start': 0.0, 'timeline__duration': 0.3}
    chosen = parameters(**{**defaults, **changes})
    excitation = build_excitation(chosen)
    if spoil is not None:
        values = excitation.values[:]
        spoil(values)
        excitation = replace(excitation, values=series_of(values))
    return SimulatedCar(flattened(chosen), excitation).mounts[ALONE]


def drive(mount: SimulatedMount, setpoint: Callable[[int], float | None] = lambda number: None):
    """Return readings (n, 4) and truth of all samples of a mount that is run to its end.

    `setpoint` gives A or None for each sample number.
    """
    readings, truths = [], []
    while not mount.finished:
        readings.append(mount.measure())
        truths.append(mount.truth.copy())
        mount.advance(setpoint(mount.sample))
    return np.array(readings), np.array(truths)
