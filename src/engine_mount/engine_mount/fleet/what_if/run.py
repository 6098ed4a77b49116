"""Many recordings replayed with other parameters, from the order to the sorted table."""

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.fleet.catalogue.places import Place, root_of
from engine_mount.fleet.foreign import NOTHING_SAID, Said
from engine_mount.fleet.job import Answer, Progress, Row, TableJob
from engine_mount.fleet.runner import LOCAL, processes_for
from engine_mount.fleet.what_if.asked import recordings_asked
from engine_mount.fleet.what_if.columns import ANOTHER_POLICY, FAILED, REPLAY_COLUMNS, REPLAYED
from engine_mount.fleet.what_if.one import failed_row, replay_one
from engine_mount.signals.sources.uris import shown
from mount_recorder.versions import versions

if TYPE_CHECKING:
    import pyarrow

_OF_SEVERAL = (ANOTHER_POLICY, REPLAYED, FAILED)  # the last of these that a mount has is its recording's
_OF_A_WORKER = ('mount_bringup', 'numpy', 'numba', 'python')
_TABLE = 'result'


@dataclass(frozen=True)
class FleetOrder:
    """What is ordered: `places` (catalogues, URIs, paths) with `changes` {node: {parameter: value}}.

    `closed_loop`: displacement is asked, not setpoints. `said` is what is said of foreign files.
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
    not_fetched: Sequence[Row] = ()  # the same order tries them again

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
    progress: Callable[[Progress], None] = lambda progress: None,
) -> FleetOutcome:
    """Replay all recordings of an order into the folder `out`, or those that an earlier run left.

    `scheduler` and `workers` as in `run_tasks`. Raises a `ValueError` or `OSError` with the reason where the
    run cannot begin or go on; what was done until then stays, and the same order goes on from there.
    """
    begin = time.monotonic()
    starting, answers = 0.0, []
    asked = recordings_asked(order.places, others=order.said.is_known)
    job = TableJob(out, {_TABLE: REPLAY_COLUMNS}, ('recording', 'mount'))
    with job.opened(order.told()):
        left = job.left(asked)
        for answer in job.run(
            left,
            partial(replay_one, changes=order.changes, closed_loop=order.closed_loop, said=order.said),
            partial(_failure, order),
            progress,
            of=len(asked),
            scheduler=scheduler,
            workers=workers,
        ):
            starting = starting or time.monotonic() - begin
            answers.append(answer)
        table = job.finish([each.uri for each in asked])[_TABLE]
    processes = len({answer.worker for answer in answers} - {''})
    if scheduler == LOCAL:  # where one was lost, another one took its place
        processes = min(processes, processes_for(workers, len(left)))
    return FleetOutcome(
        table=table,
        result=out / f'{_TABLE}.parquet',
        recordings=len(asked),
        before=len(asked) - len(left),
        outcomes=_outcomes(table.select(['recording', 'outcome']).to_pylist()),
        wall=time.monotonic() - begin,
        starting=starting,
        busy=sum(answer.busy for answer in answers),
        replayed=sum(max(row.get('duration_s') or 0.0 for row in answer.rows[_TABLE]) for answer in answers),
        workers=processes,
        not_fetched=[row for answer in answers if not answer.fingerprint for row in answer.rows[_TABLE]],
    )


def _failure(order: FleetOrder, place: Place, reason: str) -> Answer:
    """Return the row of a recording whose store is away, or whose workers were lost."""
    row = failed_row(place, reason, order.changes, order.closed_loop)
    return Answer({_TABLE: [row]}, '', failed=True)


def _outcomes(rows: Iterable[Row]) -> dict[str, int]:
    """Return how many recordings have each outcome."""
    found: dict[str, str] = {}
    for row in rows:
        outcomes = (row['outcome'], found.get(row['recording'], row['outcome']))
        found[row['recording']] = max(outcomes, key=_OF_SEVERAL.index)
    counts = Counter(found.values())
    return {outcome: counts[outcome] for outcome in _OF_SEVERAL}
