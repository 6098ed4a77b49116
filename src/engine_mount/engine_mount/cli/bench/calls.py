"""What a sample costs without middleware."""

from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from timeit import repeat

from engine_mount.cli.bench import BenchOrder, Comparison, Figures, Report
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import run_core
from engine_mount.drives.replay import replay
from mount_models.sampling import SAMPLE_TIME

_CALL_ROUNDS = 7
_DRIVE = {'mount_sim': {'scenario': 'bench', 'timeline.duration': 20.0}}


def calls(order: BenchOrder, report: Report) -> Figures:
    """Drive the bench in core with every message packed but not stored, and replay such a drive."""

    def drive() -> int:
        return run_core(_DRIVE, lambda *_: None, write_columns=lambda *_: None).samples

    samples = drive()
    driven = median(repeat(drive, number=1, repeat=_CALL_ROUNDS)) / samples
    with TemporaryDirectory() as folder:
        record_core(Path(folder) / 'recording', _DRIVE, '')
        runs = [replay(Path(folder) / 'recording') for _ in range(_CALL_ROUNDS)]
    replayed = median(run.replayed.control_time / run.samples for run in runs)
    return {
        'core': Comparison('one sample, plant and control', driven, 'real time', SAMPLE_TIME),
        'replay': Comparison('replay one sample', replayed, 'real time', SAMPLE_TIME),
    }
