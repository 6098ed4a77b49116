"""Compiles what commands would compile when they first drive, index or replay: `engine-mount prepare`."""

import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from engine_mount.fleet import catalogue, replay
from engine_mount.fleet.example import Ordered, make_one
from engine_mount.fleet.places import places
from mount_control.policy.registry import POLICIES

_SCENARIOS = ('bench', 'motorway')


def prepare(scenarios: Sequence[str] = _SCENARIOS, policies: Sequence[str] = tuple(POLICIES)) -> None:
    """Compile for these scenarios and policies, or load what is compiled already.

    A worker of a fleet that compiles by itself takes some 45 MiB more.
    """
    with tempfile.TemporaryDirectory() as folder:
        for number, (scenario, policy) in enumerate(product(scenarios, policies)):
            drive = {'sim': {'scenario': scenario}, 'control': {'policy': policy}}
            make_one(Ordered(Path(folder) / f'{scenario}_{policy}', number, drive, {}))
        for place in places([folder]).values():
            catalogue.rows_of(Path(place.uri), place)
            for closed_loop in (False, True):
                replay.rows_of(
                    Path(place.uri), place, {'mount_control': {'highest_current': 1.0}}, closed_loop
                )
