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
from dataclasses import dataclass, field
from pathlib import Path

import engine_mount
from mount_bringup.graph.domain import DomainError, domain_lock
from mount_recorder.folders import recordings_of

EARLIEST, LATEST = 0.5, 15.0  # s, chosen: when the signal comes; Python itself needs a while to start
PATIENCE = 60.0  # s, chosen: until a graph that was told to end counts as hanging
SHARED_MEMORY = '/dev/shm/'
OWN_FILES = ('engine_mount_p', 'mount_parameters_')  # beginnings of names of temporary files
LOOK_PERIOD = 0.1  # s, chosen


@dataclass
class Outcome:
    """What came of one start: when it was told to end (s) and how, its code, and what was not as required."""

    told_at: float
    number: signal.Signals
    code: int | None
    by_itself: bool
    faults: list[str] = field(default_factory=list)


def main() -> int:
    """Run the starts asked for; return 1 if one of them left anything behind or ended wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--starts', type=int, default=20)
    parser.add_argument('--kills', type=int, default=2, help='so many of the starts are ended by SIGKILL')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--domain', type=int, default=100)
    parser.add_argument('--priority', type=int, default=0)
    parser.add_argument('options', nargs='*', help='further options of engine-mount drive, behind --')
    chosen = parser.parse_args()
    draw = random.Random(chosen.seed)
    numbers = [signal.SIGKILL] * chosen.kills + [signal.SIGINT] * (chosen.starts - chosen.kills)
    draw.shuffle(numbers)
    options = ['--domain', str(chosen.domain), '--priority', str(chosen.priority), *chosen.options]
    outcomes = []
    for place, number in enumerate(numbers, 1):
        outcome = attempt(number, draw.uniform(EARLIEST, LATEST), chosen.domain, options)
        outcomes.append(outcome)
        how = ', ended by itself before' if outcome.by_itself else ''
        words = '; '.join(outcome.faults) or 'as required'
        print(
            f'{place:4d} {number.name} at {outcome.told_at:5.2f} s{how}, code {outcome.code}: {words}',
            flush=True,
        )
    failed = sum(bool(outcome.faults) for outcome in outcomes)
    alone = sum(outcome.by_itself for outcome in outcomes)
    print(f'{failed} of {len(outcomes)} not as required; {alone} ended by themselves before the signal')
    return 1 if failed else 0


def attempt(number: signal.Signals, told_at: float, domain: int, options: list[str]) -> Outcome:
    """Start the graph, end it by a signal `told_at` s later, and look what is left."""
    folder = Path(tempfile.mkdtemp(prefix='endurance_'))
    files, before = set[Path](), own_files()
    log = folder / 'said.txt'
    command = [str(Path(sys.executable).parent / 'engine-mount'), 'drive', '--scenario', 'bench',
               '--duration', '600', '--no-report', '--out', str(folder / 'run'), *options]  # fmt: skip
    with log.open('wb') as said:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True
        )
    end = time.monotonic() + told_at
    while process.poll() is None and time.monotonic() < end:
        time.sleep(LOOK_PERIOD)
        files |= files_of(process.pid)
    by_itself = process.poll() is not None
    process.send_signal(number)
    code = wait_for_end(process)
    outcome = Outcome(told_at, number, code, by_itself)
    outcome.faults += wrong_end(outcome, log.read_text(errors='replace'))
    outcome.faults += left_behind(process.pid, domain, files, before)
    outcome.faults += open_recordings(folder / 'run' / 'recording')
    if outcome.faults:
        outcome.faults.append(f'kept: {folder}')
    else:
        shutil.rmtree(folder)
    return outcome


def wait_for_end(process: subprocess.Popen[bytes]) -> int | None:
    """Return the exit code, None of one that hangs and was killed."""
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return None


def wrong_end(outcome: Outcome, said: str) -> list[str]:
    """Return what is wrong with code and words of a graph; one that was too late for 1 kHz may say so."""
    if '<frozen site>' in said and outcome.number is signal.SIGINT:
        return []  # Python itself was starting, which no program can mend; nothing was begun
    wanted = 1 if outcome.by_itself else 130 if outcome.number is signal.SIGINT else -signal.SIGKILL
    faults = [] if outcome.code == wanted else [f'code {outcome.code} instead of {wanted}']
    return [*faults, *(['traceback'] if 'Traceback' in said else [])]


def left_behind(starter: int, domain: int, files: set[Path], before: set[Path]) -> list[str]:
    """Return processes, files and the place in the domain that a graph still has, after a while."""
    end = time.monotonic() + PATIENCE
    while (left := remains(starter, domain, files, before)) and time.monotonic() < end:
        time.sleep(LOOK_PERIOD)
    return left


def remains(starter: int, domain: int, files: set[Path], before: set[Path]) -> list[str]:
    """Return what there still is of a graph at this moment, in words."""
    left = [f'process {pid}' for pid in processes_of(starter)]
    held = set().union(*(shared_memory(process) for _, process in all_processes()))
    left += [f'file {path}' for path in sorted(files - held) if path.exists()]
    left += [f'file {path}' for path in sorted(own_files() - before)]
    try:
        with domain_lock(domain, ''):
            pass
    except DomainError as error:
        left.append(str(error))
    return left


def processes_of(starter: int) -> list[int]:
    """Return the processes that a supervisor with this number has started."""
    wanted = f'ENGINE_MOUNT_STARTER={starter}'.encode()
    return [pid for pid, process in all_processes() if wanted in content(process / 'environ').split(b'\0')]


def own_files() -> set[Path]:
    """Return the temporary files of all graphs of this machine."""
    temporary = Path(tempfile.gettempdir())
    return {path for name in OWN_FILES for path in temporary.glob(f'{name}*')}


def files_of(starter: int) -> set[Path]:
    """Return the shared memory that the graph of this starter holds, its own too."""
    processes = [Path(f'/proc/{pid}') for pid in (starter, *processes_of(starter))]
    return set().union(*map(shared_memory, processes))


def shared_memory(process: Path) -> set[Path]:
    """Return the files of shared memory that a process has opened or mapped."""
    maps = content(process / 'maps').decode(errors='replace').split()
    found = {word for word in maps if word.startswith(SHARED_MEMORY)}
    with contextlib.suppress(OSError):  # it has just ended
        for descriptor in (process / 'fd').iterdir():
            with contextlib.suppress(OSError):
                found.add(str(descriptor.readlink()))
    return {Path(name) for name in found if name.startswith(SHARED_MEMORY)}


def all_processes() -> list[tuple[int, Path]]:
    """Return number and folder of each process of this machine."""
    return [(int(process.name), process) for process in Path('/proc').glob('[0-9]*')]


def content(file: Path) -> bytes:
    """Return what a file of a process holds, nothing if it has just ended."""
    try:
        return file.read_bytes()
    except OSError:
        return b''


def open_recordings(first: Path) -> list[str]:
    """Return what is wrong with the recordings of a run: each must be closed."""
    faults = []
    for folder in recordings_of(first):
        if not (folder / 'metadata.yaml').exists():
            faults.append(f'{folder.name} is not closed')
            continue
        faults += [f'{folder.name}: {warning}' for warning in engine_mount.open(folder).warnings]
    return faults


if __name__ == '__main__':
    sys.exit(main())
