"""Many recordings, as recorded and with other parameters: a row for each mount of each, in a table."""

import functools
import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from engine_mount.fleet.job import Row, Rows, TableJob
from engine_mount.fleet.places import Place, root_of, select_recordings
from engine_mount.fleet.setpoints import (
    Compared,
    Parameters,
    Recorded,
    check_concerned,
    compare_setpoints,
    recorded_in,
)
from engine_mount.recordings.recording import open_mount, open_run, recording_hash, recording_place
from engine_mount.recordings.session import versions_told
from engine_mount.reports.fleet.looks import Signals
from engine_mount.settings.chosen import NoEffectError
from engine_mount.signals.sources.stores import local_copy
from engine_mount.signals.sources.uris import shown
from mount_recorder.versions import versions

if TYPE_CHECKING:
    import pyarrow

SETPOINTS, DISPLACEMENT = 'setpoints', 'displacement'
"""What a row answers: other setpoints to the recorded displacement, or another displacement."""
REPLAYED, ANOTHER_POLICY, FAILED = 'replayed', 'another policy', 'failed'
"""What came of a recording; the change does not concern one whose policy lacks a changed parameter."""

_OF_SEVERAL = (ANOTHER_POLICY, REPLAYED, FAILED)  # the last of these that a mount has is its recording's
_OF_A_WORKER = ('mount_bringup', 'numpy', 'numba', 'python')


class Replayed(NamedTuple):
    """The table `result`, the figures that `--json` writes, and the rows that the same order tries again."""

    table: 'pyarrow.Table'
    figures: dict[str, Any]
    not_fetched: Sequence[Row]


def replay_fleet(
    sources: Sequence[str],
    changes: Parameters,
    out: Path,
    closed_loop: bool = False,
    progress: Callable[[int, int], None] = lambda done, of: None,
    **options: Any,
) -> Replayed:
    """Replay the recordings of catalogues, URIs and paths into the folder `out`, as recorded and changed.

    With `closed_loop` the displacement is simulated anew. An interrupted order goes on where it stopped.
    `options` are those of `run_tasks`. Raises a `ValueError` or `OSError` with the reason where the run
    cannot begin or go on; what was done until then stays.
    """
    begin = time.monotonic()
    recordings = select_recordings(sources)
    common = _common(changes, closed_loop)
    here = versions()
    order = {
        'asked_for': [shown(root_of(source)) for source in sources],
        'changes': changes,
        'closed_loop': closed_loop,
        'versions': {name: here[name] for name in _OF_A_WORKER},
    }
    rows = functools.partial(rows_of, changes=changes, closed_loop=closed_loop)
    job = TableJob(out, ('result',), 'recording', rows, functools.partial(_failure, common=common))
    done = job.run(recordings, progress, json.loads(json.dumps(order, default=list)), **options)
    table = done.tables['result']
    outcomes = count_outcomes(table.select(['recording', 'outcome']).to_pylist())
    wall = time.monotonic() - begin
    replayed = sum(max(row.get('duration_s') or 0.0 for row in each.rows['result']) for each in done.read)
    figures = {
        'recordings': len(recordings),
        'replayed': outcomes[REPLAYED],
        'another_policy': outcomes[ANOTHER_POLICY],
        'failed': outcomes[FAILED],
        'done_before': len(recordings) - len(done.read),
        'wall_s': wall,
        'replayed_s': replayed,
        'real_time_factor': replayed / wall,
        'result': str(out / 'result.parquet'),
    }
    not_fetched = [row for answer in done.read if not answer.fingerprint for row in answer.rows['result']]
    return Replayed(table, figures, not_fetched)


def rows_of(path: Path, place: Place, changes: Parameters, closed_loop: bool = False) -> Rows:
    """Return the rows of the recording at `path`, a copy of what lies at `place`, one for each of its mounts.

    What cannot be replayed has its reason there.
    """
    common = {'recording': place.recording, 'size_bytes': place.size_bytes, **_common(changes, closed_loop)}
    try:
        opened = open_run(path)
    except ValueError as error:
        reason = str(error).replace(str(path), place.recording)
        unread = {'sha256': recording_hash(recording_place(path))}
        return {'result': [each | unread for each in _failure(place, reason, common)['result']]}
    whole = functools.cache(lambda: recording_hash(opened.path))  # once, and where it is needed
    rows = []
    for recording in opened.by_mount():
        row: Row = {**common, 'mount': recording.mount}
        try:
            recorded = recorded_in(recording)
            check_concerned(recorded, changes)
            whole()  # the checksum of the file is taken in the same pass
            row |= _compare(recorded, changes, closed_loop).row
            version = versions_told(recorded.session).get('mount_bringup', '')
            row |= {'reason': '', 'outcome': REPLAYED, 'recorded_with': version}
        except ValueError as error:
            outcome = ANOTHER_POLICY if isinstance(error, NoEffectError) else FAILED
            row |= {'reason': str(error).replace(str(path), place.recording), 'outcome': outcome}
        rows.append(row)
    if any(row['outcome'] != ANOTHER_POLICY for row in rows):
        rows = [{'sha256': whole(), **row} for row in rows]
    return {'result': rows}


def signals_of(uri: str, changes: Parameters, mount: str = '', closed_loop: bool = False) -> Signals:
    """Return the signals of the recording at `uri`, or of one of its mounts, as recorded and with `changes`.

    Raises a `ValueError` or `OSError` with the reason where there are none.
    """
    with local_copy(uri) as path:
        return _compare(recorded_in(open_mount(path, mount)), changes, closed_loop).signals


def count_outcomes(rows: Iterable[Row]) -> dict[str, int]:
    """Return how many recordings have each outcome."""
    rising = sorted(rows, key=lambda row: _OF_SEVERAL.index(row['outcome']))
    found = {row['recording']: row['outcome'] for row in rising}
    counts = Counter(found.values())
    return {outcome: counts[outcome] for outcome in _OF_SEVERAL}


def _compare(recorded: Recorded, changes: Parameters, closed_loop: bool) -> Compared:
    if not closed_loop:
        return compare_setpoints(recorded, changes)
    from engine_mount.fleet.closed_loop import compare_motion  # loads the simulator

    return compare_motion(recorded, changes)


def _failure(place: Place, reason: str, common: Row) -> Rows:
    """Return the row of a recording that could not be read."""
    unread = {'recording': place.recording, 'mount': '', 'size_bytes': place.size_bytes}
    return {'result': [common | unread | {'reason': reason, 'outcome': FAILED}]}


def _common(changes: Parameters, closed_loop: bool) -> Row:
    """Return the columns that are the same in all rows of an order."""
    replayed_with = {name: value for name, value in versions().items() if name != 'machine'}
    return {
        'asked': DISPLACEMENT if closed_loop else SETPOINTS,
        'replayed_with': json.dumps(replayed_with, sort_keys=True),
        'changes': json.dumps(changes, sort_keys=True, default=list),
    }
