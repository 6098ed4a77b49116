"""An order for many recordings, from the first to the sorted table; goes on where it was interrupted."""

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.away import StoreWatch, reason_of
from engine_mount.fleet.catalogue.places import Place, root_of
from engine_mount.fleet.foreign import NOTHING_SAID, Said
from engine_mount.fleet.processes import LOCAL, processes_for
from engine_mount.fleet.runner import Done, run_tasks
from engine_mount.fleet.what_if.asked import recordings_asked
from engine_mount.fleet.what_if.columns import ANOTHER_POLICY, FAILED, REPLAYED
from engine_mount.fleet.what_if.one import Replayed, Row, replay_one, told_of
from engine_mount.fleet.what_if.result import Result
from engine_mount.signals.sources.uris import shown
from mount_recorder.versions import versions

if TYPE_CHECKING:
    import pyarrow

_WRITTEN_AFTER = 5.0  # s, chosen: what a run that is killed does again
_WRITTEN_TOGETHER = 200  # recordings, chosen
_OF_SEVERAL = (ANOTHER_POLICY, REPLAYED, FAILED)  # the last of these that a mount has is its recording's
_OF_A_WORKER = ('mount_bringup', 'numpy', 'numba', 'python')


@dataclass(frozen=True)
class FleetOrder:
    """What is asked: `places` (catalogues, URIs, paths) with `changes` {node: {parameter: value}}.

    `closed_loop`: displacement is asked, not setpoints. `said` is what is said of files of others.
    """

    places: Sequence[str]
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    closed_loop: bool = False
    said: Said = NOTHING_SAID

    def told(self) -> dict[str, Any]:
        """Return what makes two orders the same: all but where they run."""
        here = versions()
        told = {
            'asked_for': [shown(root_of(place)) for place in self.places],
            'changes': self.changes,
            'closed_loop': self.closed_loop,
            'versions': {name: here[name] for name in _OF_A_WORKER},
            **({'of_others': of_others} if (of_others := self.said.told) else {}),
        }
        return json.loads(json.dumps(told, default=list))


@dataclass(frozen=True)
class Advance:
    """How far an order is: recordings done of how many, their rate (1/s), and the time left (s) by it."""

    done: int
    of: int
    failed: int
    rate: float

    @property
    def left(self) -> float:
        """Time left in s."""
        return (self.of - self.done) / self.rate if self.rate > 0.0 else float('inf')


@dataclass(frozen=True)
class FleetOutcome:
    """What came of an order; times in s, `busy` those of the processors. `before`: done by earlier runs.

    `outcomes`: how many recordings were replayed, with another policy, and failed.
    `starting`: until the first recording was done, in which processes start and load libraries and laws.
    """

    table: 'pyarrow.Table'
    result: Path
    recordings: int
    before: int
    outcomes: Mapping[str, int]
    wall: float
    starting: float
    busy: float
    replayed: float
    workers: int
    not_fetched: Sequence[Row] = ()  # what the same order tries again

    def figures(self) -> dict[str, Any]:
        """Return what `--json` writes; rates are those of this run, unknown is null."""
        return {
            'recordings': self.recordings,
            'replayed': self.outcomes[REPLAYED],
            'another_policy': self.outcomes[ANOTHER_POLICY],
            'failed': self.outcomes[FAILED],
            'done_before': self.before,
            'wall_s': self.wall,
            'starting_s': self.starting,
            'processor_s': self.busy,
            'replayed_s': self.replayed,
            'real_time_factor_per_core': self.replayed / (self.wall * self.workers) if self.workers else None,
            'real_time_factor_per_processor_s': self.replayed / self.busy if self.busy else None,
            'workers': self.workers,
            'result': str(self.result),
        }


def replay_fleet(
    order: FleetOrder,
    out: Path,
    *,
    scheduler: str = LOCAL,
    workers: int = 0,
    told: Callable[[Advance], None] = lambda progress: None,
) -> FleetOutcome:
    """Replay all recordings of an order into the folder `out`, or those that an earlier run left.

    `scheduler` and `workers` as in `run_tasks`. Raises a `ValueError` or `OSError` with the reason where the
    run cannot begin or go on; what was done until then stays, and the same order goes on from there.
    """
    begin = time.monotonic()
    asked = recordings_asked(order.places, others=order.said.is_known)
    result = Result(out)
    with result.taken(order.told()):
        finished = result.finished()
        left = [each for each in asked if (each.recording, each.fingerprint) not in finished]
        run = _Run(order, result, left, told, before=len(asked) - len(left), of=len(asked))
        run.through(scheduler, workers)
        table = result.finish({each.recording: each.fingerprint for each in asked}, run.not_fetched)
    return FleetOutcome(
        table=table,
        result=result.table,
        recordings=len(asked),
        before=len(asked) - len(left),
        outcomes=_outcomes(table.select(['recording', 'outcome']).to_pylist()),
        wall=time.monotonic() - begin,
        starting=run.starting,
        busy=run.busy,
        replayed=run.replayed,
        workers=run.at_a_time,
        not_fetched=run.not_fetched,
    )


def _outcomes(rows: Iterable[Row]) -> dict[str, int]:
    """Return how many recordings have each outcome."""
    found: dict[str, str] = {}
    for row in rows:
        outcomes = (row['outcome'], found.get(row['recording'], row['outcome']))
        found[row['recording']] = max(outcomes, key=_OF_SEVERAL.index)
    counts = Counter(found.values())
    return {outcome: counts[outcome] for outcome in _OF_SEVERAL}


class _Run:
    """One run of an order: takes results as they come and writes them soon."""

    def __init__(
        self,
        order: FleetOrder,
        result: Result,
        left: Sequence[Place],
        told: Callable[[Advance], None],
        *,
        before: int,
        of: int,
    ):
        self._order, self._result, self._left, self._told = order, result, left, told
        self._before, self._of, self._failed = before, of, 0
        self._waiting: list[Row] = []
        self._recordings = 0
        self.not_fetched: list[Row] = []
        """Rows of what could not be read this time: the same order tries it again."""
        self.starting = self.busy = self.replayed = 0.0
        self._processes: set[str] = set()
        self.at_a_time = 0
        """How many workers there were."""

    def through(self, scheduler: str, workers: int) -> None:
        """Replay all that is left; what is done is written, whatever ends this."""
        order, watch = self._order, StoreWatch()
        work = partial(replay_one, changes=order.changes, closed_loop=order.closed_loop, said=order.said)
        begin = written = time.monotonic()
        try:
            for count, done in enumerate(
                run_tasks(work, self._left, scheduler=scheduler, workers=workers), 1
            ):
                now = time.monotonic()
                if count == 1:
                    self.starting = now - begin
                self._take(self._left[done.place], done)
                watch.take(done)
                if now - written >= _WRITTEN_AFTER or self._recordings >= _WRITTEN_TOGETHER:
                    self._write()
                    written = now
                self._told(
                    Advance(self._before + count, self._of, self._failed, count / max(now - begin, 1e-9))
                )
        finally:
            self._write()
        self.at_a_time = len(self._processes)
        if scheduler == LOCAL:  # where one was lost, another one took its place
            self.at_a_time = min(self.at_a_time, processes_for(workers, len(self._left)))

    def _take(self, asked: Place, done: Done[Replayed]) -> None:
        replayed = done.result
        if replayed is None:  # the store is away, the workers were lost, or a fault of this program
            row = {
                'recording': asked.recording,
                'mount': '',
                'size_bytes': asked.size,
                'reason': reason_of(done),
                'outcome': FAILED,
            }
            row |= told_of(self._order.changes, self._order.closed_loop)
            replayed = Replayed((row,), False, 0.0, '')
        self.busy += replayed.busy
        self._processes |= {replayed.worker} - {''}
        self.replayed += max((row.get('duration_s') or 0.0 for row in replayed.rows), default=0.0)
        self._failed += any(row['outcome'] == FAILED for row in replayed.rows)
        if not replayed.fetched:
            self.not_fetched += replayed.rows
            return
        self._waiting += [{**row, 'fingerprint': asked.fingerprint} for row in replayed.rows]
        self._recordings += 1

    def _write(self) -> None:
        if self._waiting:
            self._result.add(self._waiting)
        self._waiting, self._recordings = [], 0
