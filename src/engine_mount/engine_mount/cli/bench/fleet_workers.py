"""How `fleet replay` grows with its workers, beside what the machine itself gives two plain processes."""

import multiprocessing
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from multiprocessing.synchronize import Barrier
from typing import Any

from engine_mount.cli.bench.comparison import Comparison
from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.job import Answer
from engine_mount.fleet.runner import run_tasks
from engine_mount.fleet.what_if.one import replay_one

_REPEATED = 160  # recordings in a run, chosen: several seconds, in which a start tells little
_CORES = 2  # chosen: every machine that works on a fleet has them
_UNIT = 'times real time'
_PATIENCE = 600.0  # s, chosen: for a process, until it has done its part

Changes = Mapping[str, Mapping[str, Any]]


def worker_figures(
    found: Sequence[Place], changes: Changes, say: Callable[[str], None]
) -> dict[str, Comparison]:
    """Return recorded over wall time of many replays: in process, by workers, by plain processes.

    With and without the start, that is from the order on, and from when every process has done a replay.
    Needs a machine that is left alone meanwhile.
    """
    items = [found[place % len(found)] for place in range(_REPEATED)]
    work = partial(replay_one, changes=changes)
    say('measuring: fleet, in process')
    alone = _in_process(work, items)
    rates = {}
    for workers in (1, _CORES):
        say(f'measuring: fleet, workers: {workers}')
        rates[workers] = _by_workers(work, items, workers)
    say(f'measuring: fleet, plain processes: {_CORES}')
    plain = _by_plain_processes(work, items)
    figures = {}
    for place, what in enumerate(('', ', with their start')):
        name = '_started' if place else ''
        one, two = rates[1][place], rates[_CORES][place]
        figures[f'fleet_worker{name}'] = _comparison(f'one worker{what}', one, 'in process', alone)
        figures[f'fleet_workers{name}'] = _comparison(f'two workers{what}', two, 'one worker', one)
        figures[f'fleet_processes{name}'] = _comparison(
            f'two plain processes{what}', plain[place], 'in process', alone
        )
    return figures


def _comparison(what: str, ours: float, other_name: str, other: float) -> Comparison:
    return Comparison(f'{what}, in fleet replay', ours, other_name, other, _UNIT)


def _recorded(replayed: Iterable[Answer]) -> float:
    """Return the recorded time (s) in which the controller was at work."""
    return sum(float(row['duration_s']) for each in replayed for row in each.rows['result'])


def _in_process(work: Callable[[Place], Answer], items: Sequence[Place]) -> float:
    work(items[0])
    begin = time.monotonic()
    recorded = _recorded(map(work, items))
    return recorded / (time.monotonic() - begin)


def _by_workers(work: Callable[[Place], Answer], items: Sequence[Place], workers: int) -> tuple[float, float]:
    """Return recorded over wall time without and with the start."""
    begin = warm = end = time.monotonic()
    known: set[str] = set()
    all_of_it = behind = 0.0
    for done in run_tasks(work, items, workers=workers):
        assert done.result is not None, done.reason
        recorded = _recorded([done.result])
        all_of_it, behind = all_of_it + recorded, behind + recorded
        if done.result.worker not in known:
            known.add(done.result.worker)
            warm, behind = time.monotonic(), 0.0
        end = time.monotonic()
    return behind / max(end - warm, 1e-9), all_of_it / (end - begin)


def _by_plain_processes(work: Callable[[Place], Answer], items: Sequence[Place]) -> tuple[float, float]:
    """Return as `_by_workers`, of processes that share nothing and are told all they do beforehand."""
    context = multiprocessing.get_context('spawn')
    barrier, told = context.Barrier(_CORES), context.Queue()
    parts = [items[place::_CORES] for place in range(_CORES)]
    processes = [context.Process(target=_replay, args=(work, part, barrier, told)) for part in parts]
    begin = time.monotonic()
    for process in processes:
        process.start()
    results = [told.get(timeout=_PATIENCE) for _ in processes]
    end = time.monotonic()
    for process in processes:
        process.join()
    recorded = sum(each for each, _ in results)
    return recorded / max(seconds for _, seconds in results), recorded / (end - begin)


def _replay(work: Callable[[Place], Answer], items: Sequence[Place], barrier: Barrier, told: Any) -> None:
    work(items[0])
    barrier.wait(_PATIENCE)
    begin = time.monotonic()
    recorded = _recorded(map(work, items))
    told.put((recorded, time.monotonic() - begin))
