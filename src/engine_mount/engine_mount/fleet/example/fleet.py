"""Makes the example fleet: the same bytes each time on the same installation."""

import hashlib
import math
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

import engine_mount
from engine_mount.drives.drive import check_drive, parameters_of_session
from engine_mount.drives.loop.recording import record_core
from engine_mount.fleet.example.damages import DAMAGES
from engine_mount.fleet.example.variations import DRIVES, VARIATIONS, Drive, Variation
from engine_mount.fleet.runner import Done, run_tasks
from engine_mount.recordings.cut import cut
from engine_mount.settings.mounts import settings_of_mounts
from engine_mount.settings.options import with_sample_rate
from mount_bringup.settings import checked_settings
from mount_recorder.session import session_text
from mount_recorder.versions import versions
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.mount_choice import with_control_of_mount

WHOLE_FLEET = len(DRIVES) * len(VARIATIONS)
FEWEST = len(DAMAGES) + 1
START = 3.5  # s, chosen: rest before the excitation, in which the mount is initialised
SECONDS = 4.0  # s, chosen: length of the excitation
FIRST_DAY = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)  # chosen
BETWEEN = timedelta(minutes=17)  # chosen: from one drive to the next


class ExampleError(ValueError):
    """An example fleet cannot be made; the text says why."""


@dataclass(frozen=True)
class Ordered:
    """One recording to make: the folder of it, what is driven (`seconds` of excitation), and its damage."""

    folder: Path
    number: int  # of all of the whole fleet
    drive: Drive
    variation: Variation
    damage: str = ''
    seconds: float = SECONDS

    @property
    def started(self) -> datetime:
        """When it pretends to have been driven."""
        return FIRST_DAY + self.number * BETWEEN


def make_example(
    folder: Path, recordings: int = WHOLE_FLEET, seconds: float = SECONDS, workers: int = 0
) -> Iterator[Done[Path]]:
    """Make so many recordings below the new folder `folder` and return each as it is done.

    One of each kind of damage is among them, the others are spread over drives and variations. `seconds` is
    the length of the excitation, of a sweep at most its own. Raises `ExampleError`.
    """
    if not FEWEST <= recordings <= WHOLE_FLEET:
        raise ExampleError(f'the example fleet has {FEWEST} to {WHOLE_FLEET} recordings, not {recordings}')
    if not 4.0 <= seconds <= 7200.0:
        raise ExampleError(f'an excitation of 4 to 7200 s can be driven, not of {seconds:g} s')
    if folder.exists() and any(folder.iterdir()):
        raise ExampleError(f'{folder} exists and is not empty; choose another folder with --out')
    orders = [replace(order, seconds=seconds) for order in chosen(folder, recordings)]
    return run_tasks(make_one, orders, workers=workers)


def chosen(folder: Path, recordings: int) -> list[Ordered]:
    """Return what is made of the whole fleet: all damaged ones, and of the others evenly spread ones."""
    every = list(whole_fleet(folder))
    damaged = [order for order in every if order.damage]
    others = [order for order in every if not order.damage]
    count = recordings - len(damaged)
    # A step that has no common divisor with their number meets each drive and each variation early.
    spread = [others[place * 71 % len(others)] for place in range(count)]
    return sorted([*damaged, *spread], key=lambda order: order.number)


def whole_fleet(folder: Path) -> Iterator[Ordered]:
    """Return all recordings; the last variation of the first drives is damaged, each in its own way."""
    damages = [*DAMAGES, *[''] * len(DRIVES)]
    for place, drive in enumerate(DRIVES):
        for number, variation in enumerate(VARIATIONS):
            damage = damages[place] if variation is VARIATIONS[-1] else ''
            changed = VARIATIONS[0] if damage else variation
            name = f'{number:02d}_{damage or variation.name}'
            yield Ordered(
                folder / drive.name / name, place * len(VARIATIONS) + number, drive, changed, damage
            )


def make_one(order: Ordered) -> Path:
    """Make one recording and return its folder."""
    order.folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=order.folder.parent, prefix='.making_') as scratch:
        made = _driven(order, Path(scratch) / order.folder.name)
        if order.variation.cut is not None:
            made = _piece(order, made, Path(scratch) / 'piece' / order.folder.name)
        if order.damage:
            seed = int.from_bytes(hashlib.sha256(order.damage.encode()).digest()[:4], 'big')
            DAMAGES[order.damage](made, np.random.default_rng(seed))
        shutil.move(made, order.folder)
    return order.folder


def settings_of(order: Ordered) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes of a drive."""
    drive, variation = order.drive, order.variation
    switched = drive.control.get('policy') == 'switched_viscous'
    timeline = {'timeline.start': START, 'timeline.duration': min(order.seconds, _longest(drive))}
    seed = {'seed': 10 * (order.number // len(VARIATIONS)) + int(variation.sim.get('seed', 1))}
    control = {**drive.control, **(variation.switched if switched else variation.control)}
    settings: dict[str, dict[str, Any]] = {'mount_sim': {**drive.sim, **timeline, **variation.sim, **seed}}
    if control and not variation.own_control:
        settings['mount_control'] = control
    return with_control_of_mount(with_sample_rate(checked_settings(settings), variation.sample_rate))


def _longest(drive: Drive) -> float:
    """Return how long a drive can be (s): a sweep ends at its last frequency."""
    if drive.sim['scenario'] != 'sweep':
        return math.inf
    sweep = SweepScenario()._replace(
        first_frequency=drive.sim['sweep.first_frequency'], rate=drive.sim['sweep.rate']
    )
    return (sweep.last_frequency - sweep.first_frequency) / sweep.rate


def _driven(order: Ordered, folder: Path) -> Path:
    parameters = settings_of(order)
    excitation = check_drive(parameters, core=True)
    begin = round(order.started.timestamp()) * 1_000_000_000
    sessions = {name: _session(order, values) for name, values in settings_of_mounts(parameters).items()}
    record_core(folder, parameters, sessions, excitation=excitation, begin=begin)
    return folder


def _session(order: Ordered, parameters: dict[str, dict[str, Any]]) -> str:
    return session_text(
        {
            'scenario': order.drive.sim['scenario'],
            'mode': 'core',
            'parameters': parameters_of_session(parameters),
            'started': order.started.isoformat(timespec='seconds'),
            'versions': versions(),
        }
    )


def _piece(order: Ordered, whole: Path, folder: Path) -> Path:
    assert order.variation.cut is not None
    folder.parent.mkdir()
    begin, end = order.variation.cut
    cut(engine_mount.open(whole), folder, begin, end, made=order.started.isoformat(timespec='seconds'))
    return folder
