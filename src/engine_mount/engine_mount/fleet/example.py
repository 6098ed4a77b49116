"""A fleet to try things on: short simulated drives, a few of them damaged; the same bytes each time."""

import hashlib
import math
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

import engine_mount
from engine_mount.drives.drive import check_drive, parameters_of_session
from engine_mount.drives.loop.recording import record_core
from engine_mount.fleet.places import places
from engine_mount.fleet.runner import Done, run_tasks
from engine_mount.recordings.edit import cut
from engine_mount.settings.options import settings_of_mounts, with_sample_rate
from mount_bringup.settings import checked_settings
from mount_control.policy.registry import DAMPERS
from mount_recorder.metadata import METADATA_NAME
from mount_recorder.session import session_text
from mount_recorder.versions import versions
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.plant.mounts import with_control_of_mount

Settings = Mapping[str, Any]

_DECLARED = yaml.safe_load(Path(__file__).with_name('example.yaml').read_text(encoding='utf-8'))
DRIVES: Mapping[str, Settings] = _DECLARED['drives']
VARIATIONS: Mapping[str, Settings] = _DECLARED['variations']
DAMAGES = ('truncated', 'no_metadata', 'garbage', 'no_data', 'wrong_checksum')

WHOLE_FLEET = len(DRIVES) * len(VARIATIONS)
FEWEST = len(DAMAGES) + 1
START = 3.5  # s, chosen: rest before the excitation, in which the mount is initialised
SECONDS = 4.0  # s, chosen: length of the excitation
FIRST_DAY = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)  # chosen
BETWEEN = timedelta(minutes=17)  # chosen: from one drive to the next


class ExampleError(ValueError):
    """An example fleet cannot be made; the text says why."""


class Ordered(NamedTuple):
    """One recording to make: its folder and number in the whole fleet, and entries of example.yaml."""

    folder: Path
    number: int
    drive: Settings
    variation: Settings
    damage: str = ''
    seconds: float = SECONDS

    @property
    def started(self) -> datetime:
        """When it pretends to have been driven."""
        return FIRST_DAY + self.number * BETWEEN


def make_example(
    folder: Path, recordings: int = WHOLE_FLEET, seconds: float = SECONDS, workers: int = 0
) -> Iterator[Done]:
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
    every = whole_fleet(folder, seconds)
    others = [order for order in every if not order.damage]
    # A step that has no common divisor with their number meets each drive and each variation early.
    spread = [others[place * 71 % len(others)] for place in range(recordings - len(DAMAGES))]
    orders = sorted([*spread, *(order for order in every if order.damage)], key=lambda order: order.number)
    return run_tasks(make_one, orders, workers=workers)


def whole_fleet(folder: Path, seconds: float = SECONDS) -> list[Ordered]:
    """Return all recordings; the last variation of the first drives is damaged, each in its own way."""
    orders: list[Ordered] = []
    for place, (name, drive) in enumerate(DRIVES.items()):
        for number, (variation, changed) in enumerate(VARIATIONS.items()):
            damage = ''.join(DAMAGES[place : place + 1]) if number == len(VARIATIONS) - 1 else ''
            made = folder / name / f'{number:02d}_{damage or variation}'
            changed = VARIATIONS['plain'] if damage else changed
            orders.append(Ordered(made, len(orders), drive, changed, damage, seconds))
    return orders


def make_one(order: Ordered) -> Path:
    """Make one recording and return its folder."""
    order.folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=order.folder.parent, prefix='.making_') as scratch:
        made = Path(scratch) / order.folder.name
        _drive(order, made)
        if 'cut' in order.variation:
            whole, made = made, Path(scratch) / 'piece' / order.folder.name
            made.parent.mkdir()
            begin, end = order.variation['cut']
            cut(engine_mount.open(whole), made, begin, end, made=order.started.isoformat(timespec='seconds'))
        if order.damage:
            _spoil(made, order.damage)
        shutil.move(made, order.folder)
    return order.folder


def settings_of(order: Ordered) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes of a drive."""
    sim, variation = order.drive['sim'], order.variation
    control = order.drive.get('control', {})
    is_switched = control.get('policy') == 'switched_viscous'
    longest = math.inf
    if sim['scenario'] == 'sweep':  # it ends at its last frequency
        rate, first = sim['sweep.rate'], sim['sweep.first_frequency']
        longest = (SweepScenario().last_frequency - first) / rate
    of_variation = variation.get('sim', {})
    seed = 10 * (order.number // len(VARIATIONS)) + of_variation.get('seed', 1)
    timeline = {'timeline.start': START, 'timeline.duration': min(order.seconds, longest)}
    settings = {'mount_sim': {**sim, **timeline, **of_variation, 'seed': seed}}
    control = {**control, **variation.get('switched' if is_switched else 'control', {})}
    if control and not variation.get('own_control'):
        settings['mount_control'] = control
    return with_control_of_mount(with_sample_rate(checked_settings(settings), variation.get('sample_rate')))


def _drive(order: Ordered, folder: Path) -> None:
    parameters = settings_of(order)
    sessions = {
        name: session_text(
            {
                'scenario': order.drive['sim']['scenario'],
                'mode': 'core',
                'parameters': parameters_of_session(values),
                'started': order.started.isoformat(timespec='seconds'),
                'versions': versions(),
            }
        )
        for name, values in settings_of_mounts(parameters).items()
    }
    begin = round(order.started.timestamp()) * 1_000_000_000
    record_core(folder, parameters, sessions, excitation=check_drive(parameters, core=True), begin=begin)


def _spoil(folder: Path, damage: str) -> None:
    """Do to a whole recording what happens in the field."""
    random = np.random.default_rng(int.from_bytes(hashlib.sha256(damage.encode()).digest()[:4], 'big'))
    (file,) = folder.glob('*.mcap')
    content = file.read_bytes()
    match damage:
        case 'truncated':  # as a power failure does
            file.write_bytes(content[: int(0.6 * len(content))])
        case 'no_metadata':  # easily left behind when a file is copied
            (folder / METADATA_NAME).unlink()
        case 'garbage':  # as a broken disk does
            file.write_bytes(random.bytes(65_536))
        case 'no_data':  # metadata.yaml alone, for a store of objects knows no empty folder
            file.unlink()
        case 'wrong_checksum':
            middle = len(content) // 2
            file.write_bytes(content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :])


def prepare(
    scenarios: Sequence[str] = ('bench', 'motorway'), policies: Sequence[str] = tuple(DAMPERS)
) -> None:
    """Compile for these scenarios and policies, or load what is compiled already.

    A worker of a fleet that compiles by itself takes some 45 MiB more.
    """
    from engine_mount.fleet import catalogue, replay  # load more than an example needs

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
