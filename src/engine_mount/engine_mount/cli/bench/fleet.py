"""What a recorded second costs in `fleet replay`, reading from local disk included, and where it goes."""

import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice, pairwise
from pathlib import Path

from engine_mount.cli.bench.comparison import Comparison
from engine_mount.drives.inputs.taken import QUIET_AT_FIRST
from engine_mount.fleet.catalogue.places import Place, places
from engine_mount.fleet.example.fleet import make_one, whole_fleet
from engine_mount.fleet.example.variations import VARIATIONS
from engine_mount.fleet.runner import run_tasks
from engine_mount.fleet.what_if.compared import compared_setpoints, recorded_in
from engine_mount.fleet.what_if.one import replay_one
from engine_mount.recordings.place import recording_hash
from engine_mount.recordings.recording import column_parts, open_recording
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

_RECORDINGS = 3  # chosen: the plain ones of the first drives; all topics of the simulator are in them
_SECONDS = 20.0  # s, chosen: of each excitation
_ROUNDS = 7
_REPLAYS = 160  # of a run with workers, chosen: several seconds, beside which their start is short
_WORKERS = 2  # chosen: every machine that works on a fleet has two cores
_CHANGE = {'mount_control': {'highest_current': 2.0}}
_COLUMNS = {
    DISPLACEMENT.name: DISPLACEMENT.names,
    CURRENT_SETPOINT.name: CURRENT_SETPOINT.names,
    CONTROL_TRACE.name: ('displacement', *QUIET_AT_FIRST),
}


def fleet_figures(
    say: Callable[[str], None], seconds: float = _SECONDS, rounds: int = _ROUNDS
) -> dict[str, Comparison]:
    """Return what a recorded second costs and where it goes, and how that grows with the workers.

    It is processor time (s), of all beside real time and of the stages beside all; then
    the recorded time over the wall time of many replays by one worker and by two, with their start.
    `seconds` is the length of the excitations. A second counts where the controller was at work, as in the
    figures of `fleet replay`; what a process does once, such as to load the compiled laws, does not.
    """
    with tempfile.TemporaryDirectory() as folder:
        for order in islice(whole_fleet(Path(folder)), 0, _RECORDINGS * len(VARIATIONS), len(VARIATIONS)):
            make_one(replace(order, seconds=seconds))
        found = list(places([folder]).values())
        recorded = sum(
            row['duration_s'] for place in found for row in replay_one(place, _CHANGE).rows['result']
        )
        times = [_stages(found) for _ in range(rounds)]
        rates = [_rate(found, workers, say) for workers in (1, _WORKERS)]
    whole, *stages = (statistics.median(each) / recorded for each in zip(*times, strict=True))
    figures = {'fleet': Comparison('a recorded second in fleet replay', whole, 'real time', 1.0)}
    for (name, what), stage in zip(_STAGES.items(), stages, strict=True):
        figures[f'fleet_{name}'] = Comparison(f'of it {what}', stage, 'all of it', whole)
    what = f'{_WORKERS} workers in fleet replay, with their start'
    return figures | {'fleet_workers': Comparison(what, rates[1], 'one worker', rates[0], 'times real time')}


_STAGES = {
    'open': 'to open it and take its checksums',
    'beside': 'what it says beside its samples',
    'columns': 'its columns out of the chunks',
    'control': 'two controllers, and figures',
}


def _rate(found: Sequence[Place], workers: int, say: Callable[[str], None]) -> float:
    """Return the recorded time over the wall time of `_REPLAYS` replays."""
    say(f'measuring: fleet, workers: {workers}')
    items = [found[place % len(found)] for place in range(_REPLAYS)]
    begin = time.monotonic()
    answers = [
        done.result for done in run_tasks(partial(replay_one, changes=_CHANGE), items, workers=workers)
    ]
    rows = [row for answer in answers if answer is not None for row in answer.rows['result']]
    return float(sum(row['duration_s'] for row in rows)) / (time.monotonic() - begin)


def _stages(found: Sequence[Place]) -> tuple[float, ...]:
    """Return the processor time (s) of all replays, and of each of `_STAGES`."""
    begin = time.process_time()
    for place in found:
        replay_one(place, _CHANGE)
    whole = time.process_time() - begin
    stages = [_stages_of_one(Path(place.uri)) for place in found]
    return whole, *(sum(each) for each in zip(*stages, strict=True))


def _stages_of_one(path: Path) -> tuple[float, ...]:
    times = [time.process_time()]
    recording = open_recording(path)
    recording_hash(path)
    times.append(time.process_time())
    recorded = recorded_in(recording)
    times.append(time.process_time())
    for _ in column_parts(recording, _COLUMNS):
        pass
    times.append(time.process_time())
    compared_setpoints(recorded, _CHANGE)  # reads the columns once more
    times.append(time.process_time())
    opened, beside, columns, compared = (after - before for before, after in pairwise(times))
    return opened, beside, columns, compared - columns
