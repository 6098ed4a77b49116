"""What the tests share: simulated mounts by their parameters, and runs of them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mount_models.arithmetic.series import series_of
from mount_models.quantity import flattened, with_flattened
from mount_sim.excitation.building import build_excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import ALONE
from mount_sim.plant.simulated_car import SimulatedCar, SimulatedMount


def sim_parameters(**changes: Any) -> SimParameters:
    """Parameters with some changed; `bench__amplitude` stands for `bench.amplitude`."""
    return with_flattened(
        SimParameters(), {name.replace('__', '.'): value for name, value in changes.items()}
    )


@pytest.fixture(scope='session')
def parameters() -> Callable[..., SimParameters]:
    return sim_parameters


@pytest.fixture(scope='session')
def make_mount() -> Callable[..., SimulatedMount]:
    """Return a function that builds a simulated mount; by default on the bench for 0.3 s.

    `spoil` changes the numbers that shake it, in their place.
    """

    def make(spoil: Callable[[np.ndarray], None] | None = None, **changes: Any) -> SimulatedMount:
        defaults = {'scenario': 'bench', 'timeline__start': 0.0, 'timeline__duration': 0.3}
        chosen = sim_parameters(**{**defaults, **changes})
        excitation = build_excitation(chosen)
        if spoil is not None:
            values = excitation.values[:]
            spoil(values)
            excitation = replace(excitation, values=series_of(values))
        return SimulatedCar(flattened(chosen), excitation).mounts[ALONE]

    return make


@pytest.fixture(scope='session')
def drive() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """Return a function that runs a mount to its end; `setpoint` gives A or None for each sample number.

    It returns the readings (n, 4) and the truth of all samples.
    """

    def run(mount: SimulatedMount, setpoint: Callable[[int], float | None] = lambda number: None):
        readings, truths = [], []
        while not mount.finished:
            readings.append(mount.measure())
            truths.append(mount.truth.copy())
            mount.advance(setpoint(mount.sample))
        return np.array(readings), np.array(truths)

    return run
