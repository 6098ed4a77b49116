"""Compiles what commands would compile when they first drive, index or replay: `engine-mount prepare`."""

import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from engine_mount.fleet.catalogue.places import places
from engine_mount.fleet.catalogue.reading import read_place
from engine_mount.fleet.example.fleet import Ordered, make_one
from engine_mount.fleet.example.variations import VARIATIONS, Drive
from engine_mount.fleet.what_if.one import replay_one
from mount_control.policy.registry import POLICIES

_SCENARIOS = ('bench', 'motorway')


def prepare(scenarios: Sequence[str] = _SCENARIOS, policies: Sequence[str] = tuple(POLICIES)) -> None:
    """Compile for these scenarios and policies, or load what is compiled already.

    A worker of a fleet that compiles by itself takes some 45 MiB more.
    """
    with tempfile.TemporaryDirectory() as folder:
        for number, (scenario, policy) in enumerate(product(scenarios, policies)):
            drive = Drive(f'{scenario}_{policy}', {'scenario': scenario}, {'policy': policy})
            make_one(Ordered(Path(folder) / drive.name, number, drive, VARIATIONS[0]))
        for place in places([folder]).values():
            read_place(place)
            for closed_loop in (False, True):
                replay_one(place, {'mount_control': {'highest_current': 1.0}}, closed_loop)
