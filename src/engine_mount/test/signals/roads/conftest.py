"""Roads and tables that the tests share."""

import numpy as np
import pytest

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.roads.iso8608 import RoadProfile
from mount_sim.excitation.road import RandomRoad, random_road


@pytest.fixture(scope='session')
def made_road():
    """A function that makes a road of known Gd(n0) (m^3) and waviness."""

    def make(roughness=64e-6, waviness=2.0, length=300.0, spacing=0.05, seed=1):
        places = np.arange(0.0, length, spacing)
        shape = RandomRoad(roughness, waviness, 0.005, min(10.0, 0.4 / spacing), 10.0, 0.0, seed)
        height = random_road(places / shape.speed, shape)
        return RoadProfile(0.0, spacing, height, Provenance('made.csv', '', 0, '', ''))

    return make
