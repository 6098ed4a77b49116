"""Starts and stops the whole graph again and again, and looks whether anything is left behind.

Run by hand, on a machine with nothing else to do: python test/graph/endurance.py --starts 200 --kills 20
"""

import argparse
import contextlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

import psutil

import engine_mount
from mount_bringup.graph.domain import domain_lock
from mount_models.quantity import ParameterError
from mount_recorder.folders import recordings_of

EARLIEST, LATEST = 0.5, 15.0  # s, chosen: when the signal comes; Python itself needs a while to start
PATIENCE = 60.0  # s, chosen: until a graph that was told to end counts as hanging
OWN_FILES = ('engine_mount_p*', 'mount_parameters_*')  # names of temporary files
LOOK_PERIOD = 0.1  # s, chosen
SHARED_MEMORY = '/dev/shm/'


def main() -> int:
    """Run the starts asked for; return 1 if one of them left anything behind or ended wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--starts', type=int, default=20)
    parser.add_argument('--kills', type=int, default=2, help='so many of the starts are ended by SIGKILL')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--domain', type=int, default=100)
    parser.add_argument('--priority', default='0')
    parser.add_argument('options', nargs='*', help='further options of engine-mount drive, behind --')
    chosen = parser.parse_args()
    draw = random.Random(chosen.seed)
    numbers = [signal.SIGKILL] * chosen.kills + [signal.SIGINT] * (chosen.starts - chosen.kills)
    draw.shuffle(numbers)
    failed = 0
    for place, number in enumerate(numbers, 1):
        at = draw.uniform(EARLIEST, LATEST)
        faults = attempt(number, at, chosen.domain, ['--priority', chosen.priority, *chosen.options])
        failed += bool(faults)
        print(f'{place:4d} {number.name} at {at:5.2f} s: {"; ".join(faults) or "as required"}', flush=True)
    print(f'{failed} of {len(numbers)} not as required')
    return 1 if failed else 0


def attempt(number: signal.Signals, at: float, domain: int, options: list[str]) -> list[str]:
    """Start the graph, end it by a signal `at` s later, and return what is not as required."""
    folder = Path(tempfile.mkdtemp(prefix='endurance_'))
    log, before = folder / 'said.txt', own_files()
    command = [str(Path(sys.executable).parent / 'engine-mount'), 'drive', '--scenario', 'bench',
               '--duration', '600', '--no-report', '--out', str(folder / 'run'), '--domain', str(domain),
               *options]  # fmt: skip
    with log.open('wb') as said:
        graph = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True
        )
    starter = psutil.Process(graph.pid)
    processes, shared = {starter}, set[Path]()
    end = time.monotonic() + at
    while graph.poll() is None and time.monotonic() < end:
        time.sleep(LOOK_PERIOD)
        with contextlib.suppress(psutil.Error):  # it has just ended
            processes |= {*starter.children(recursive=True)}
        shared |= shared_memory(processes)
    by_itself = graph.poll() is not None
    graph.send_signal(number)
    faults = wrong_end(graph, number, by_itself, log)
    end = time.monotonic() + PATIENCE
    while (left := remains(processes, shared, domain, before)) and time.monotonic() < end:
        time.sleep(LOOK_PERIOD)
    faults += left + open_recordings(folder / 'run' / 'recording')
    if faults:
        return [*faults, f'kept: {folder}']
    shutil.rmtree(folder)
    return []


def wrong_end(
    graph: subprocess.Popen[bytes], number: signal.Signals, by_itself: bool, log: Path
) -> list[str]:
    """Return what is wrong with code and words of a graph; one that was too late for 1 kHz may say so."""
    try:
        code = graph.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        graph.kill()
        return [f'it hangs, and was killed (code {graph.wait()})']
    said = log.read_text(errors='replace')
    if '<frozen site>' in said and number is signal.SIGINT:
        return []  # Python itself was starting, which no program can mend; nothing was begun
    wanted = 1 if by_itself else 130 if number is signal.SIGINT else -signal.SIGKILL
    faults = [] if code == wanted else [f'code {code} instead of {wanted}']
    return [*faults, *(['traceback'] if 'Traceback' in said else [])]


def remains(processes: set[psutil.Process], shared: set[Path], domain: int, before: set[Path]) -> list[str]:
    """Return what there still is of a graph at this moment, in words."""
    left = [f'process {process.pid}' for process in processes if process.is_running()]
    files = {path for path in shared - shared_memory(psutil.process_iter()) if path.exists()}
    left += [f'file {path}' for path in sorted(files | own_files() - before)]
    try:
        with domain_lock(domain, ''):
            pass
    except ParameterError as error:
        left.append(str(error))
    return left


def shared_memory(processes: Iterable[psutil.Process]) -> set[Path]:
    """Return the files of shared memory that processes have mapped."""
    found = set[Path]()
    for process in processes:
        with contextlib.suppress(psutil.Error):  # it has just ended, or is of another user
            paths = [each.path.removesuffix(' (deleted)') for each in process.memory_maps()]
            found |= {Path(path) for path in paths if path.startswith(SHARED_MEMORY)}
    return found


def own_files() -> set[Path]:
    """Return the temporary files of all graphs of this machine."""
    return {path for name in OWN_FILES for path in Path(tempfile.gettempdir()).glob(name)}


def open_recordings(first: Path) -> list[str]:
    """Return what is wrong with the recordings of a run: each must be closed."""
    faults = []
    for folder in recordings_of(first):
        closed = (folder / 'metadata.yaml').exists()
        warnings = engine_mount.open(folder).warnings if closed else ['not closed']
        faults += [f'{folder.name}: {warning}' for warning in warnings]
    return faults


if __name__ == '__main__':
    sys.exit(main())
