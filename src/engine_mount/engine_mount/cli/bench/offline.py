"""What costs time without middleware: a sample, and the import of a foreign file of an hour."""

import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np

from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report, median_times
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
    driven = median_times({'drive': drive}, _CALL_ROUNDS)['drive'] / samples
    with TemporaryDirectory() as folder:
        record_core(Path(folder) / 'recording', _DRIVE, '')
        runs = [replay(Path(folder) / 'recording') for _ in range(_CALL_ROUNDS)]
    replayed = median(run.replayed.control_time / run.samples for run in runs)
    return {
        'core': Comparison('one sample, plant and control', driven, 'real time', SAMPLE_TIME),
        'replay': Comparison('replay one sample', replayed, 'real time', SAMPLE_TIME),
    }


_AMPLITUDES = {'displacement (mm)': 1.5, 'force (N)': 200.0, 'current (A)': 2.0}  # chosen
_PROGRAM = """import atexit
from engine_mount.cli.command import main
atexit.register(lambda: print(open('/proc/self/status').read()))
main()"""


def imports(order: BenchOrder, report: Report, seconds: float = 3600.0) -> Figures:
    """Import `seconds` of three quantities at 1 kHz from CSV and from MDF4, each in a process of its own.

    Time and most memory stand beside the limits for an hour, 30 s and 500 MB, chosen. The import reports its
    memory itself: what `wait4` returns is at least the memory of this process, which holds the numbers.
    """
    stamps = np.arange(round(seconds / SAMPLE_TIME)) * SAMPLE_TIME
    columns = {title: size * np.sin(2.0 * np.pi * 8.0 * stamps) for title, size in _AMPLITUDES.items()}
    found = {}
    for name, write in (('csv', _write_csv), ('mf4', _write_mdf)):
        report(f'importing {seconds:g} s from {name}')
        with TemporaryDirectory() as folder:
            file = Path(folder) / f'measured.{name}'
            write(file, stamps, columns)
            begin = time.perf_counter()
            process = subprocess.run(
                [sys.executable, '-P', '-c', _PROGRAM, 'import', str(file), '--out', f'{folder}/imported'],
                stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
            wall = time.perf_counter() - begin
        if process.returncode:
            raise ValueError(f'the import of {name} ended with {process.returncode}')
        most = 1.024e-3 * int(process.stdout.rpartition('VmHWM:')[2].split()[0])
        found[f'import_{name}'] = Comparison(f'import {name}, 3 quantities', wall, 'limit', 30.0)
        found[f'import_{name}_memory'] = Comparison(f'import {name}, most memory', most, 'limit', 500.0, 'MB')
    return found


def _write_csv(file: Path, stamps: np.ndarray, columns: dict[str, np.ndarray]) -> None:
    from pyarrow import csv, table

    csv.write_csv(table({'time (s)': stamps, **columns}), file)


def _write_mdf(file: Path, stamps: np.ndarray, columns: dict[str, np.ndarray]) -> None:
    from asammdf import MDF, Signal

    mdf = MDF()
    signals = []
    for title, values in columns.items():
        name, unit = title[:-1].split(' (')
        signals.append(Signal(values, stamps, unit, name))
    mdf.append(signals)
    mdf.save(file)
