"""What the tests of the whole graph share: a ROS domain of their own, and the command as users run it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
LIMIT = 240.0  # s: only a hang takes so long
LATE = 0.020  # s: a setpoint that comes later than this is answered with 0 A
ATTEMPTS, ATTEMPTS_IN_CI = 2, 4

# Ahead of everything else, so that it is late only when the machine itself stands still.
WATCH_TIME = """
import os, select, sys, time
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(os.sched_get_priority_max(os.SCHED_FIFO)))
latest, due = 0.0, time.monotonic()
while not select.select([sys.stdin], [], [], 1e-3)[0]:
    now = time.monotonic()
    latest, due = max(latest, now - due), now + 1e-3
print(latest)
"""

# About the work of the 1 kHz loop on two cores, each sample begun at its time or when the last one is done.
# Nothing of this project takes part.
KEEP_TIME = """
import time
begin, latest = time.monotonic(), 0.0
for sample in range(3000):
    remaining = begin + 1e-3 * sample - time.monotonic()
    latest = max(latest, -remaining)
    time.sleep(max(remaining, 0.0))
    for _ in range(4500):
        pass
print(latest)
"""


@dataclass
class Result:
    """What a command did."""

    code: int
    output: str
    figures: dict[str, Any] = field(default_factory=dict)
    folder: Path = Path()


class Command:
    """The `engine-mount` command in a folder of its own."""

    def __init__(self, folder: Path, domain: int):
        self.folder = folder
        self.domain = domain
        self._runs = 0

    def drive(self, *options: str, report: bool = False) -> Result:
        """Run a drive to its end and read its figures; a report about it takes longer than a short drive."""
        process, out = self.start_drive(*options, '--report' if report else '--no-report')
        output, _ = process.communicate(timeout=LIMIT)
        summary = out / 'summary.json'
        figures = json.loads(summary.read_text()) if summary.exists() else {}
        return Result(process.returncode, output, figures, out)

    def start_drive(self, *options: str) -> tuple[subprocess.Popen[str], Path]:
        """Start a drive and return its process and the folder of the run."""
        self._runs += 1
        out = self.folder / f'run_{self._runs}'
        return self.start('drive', '--out', str(out), *options), out

    def start(self, *arguments: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
        """Start the command; `stdin` is a file descriptor."""
        return subprocess.Popen(
            [str(Path(sys.executable).parent / 'engine-mount'), *arguments],
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=self.folder,
            env={**os.environ, 'ROS_DOMAIN_ID': str(self.domain), 'COLUMNS': '200', 'NO_COLOR': '1'},
        )


@pytest.fixture
def command(tmp_path: Path, domain: int) -> Iterator[Command]:
    """The command; what it started and left behind is ended."""
    started: list[subprocess.Popen[str]] = []

    class Watched(Command):
        def start(self, *arguments: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
            started.append(super().start(*arguments, stdin=stdin))
            return started[-1]

    yield Watched(tmp_path, domain)
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait(30)


@pytest.fixture(scope='session')
def skip_if_late() -> Callable[[str], None]:
    """Skip the test if two processes that only keep time are late too; the text says what was wrong.

    Not in continuous integration: there a failure of the safe state must not pass for a slow machine.
    """

    def skip(what: str) -> None:
        if not os.environ.get('CI') and (late := lateness_of_machine()) > LATE:
            pytest.skip(f'without us too this machine is {late * 1e3:.0f} ms late at 1 kHz; {what}')

    return skip


@pytest.fixture(scope='session')
def repeat_if_late() -> Callable[[Callable[[], str]], None]:
    """Call a trial again while it returns by what the machine was too late; at last skip, or fail in CI."""

    def repeat(trial: Callable[[], str]) -> None:
        for _ in range(attempts()):
            if not (late := trial()):
                return
        (pytest.fail if os.environ.get('CI') else pytest.skip)(f'too late for real time: {late}')

    return repeat


def attempts() -> int:
    """Return how often a drive in real time is tried."""
    return ATTEMPTS_IN_CI if os.environ.get('CI') else ATTEMPTS


@pytest.fixture
def drive_in_time(command: Command, skip_if_late: Callable[[str], None]) -> Callable[..., Result]:
    """Drive in real time, once more if something was late; a machine too late by itself skips the test."""

    def drive(*options: str) -> Result:
        for _ in range(attempts()):
            with machine_watched() as stood_still:
                result = command.drive(*options, report=True)
            if result.code == 0 and result.figures['lost_samples'] == 0:
                return result
        if not os.environ.get('CI') and stood_still() > LATE:
            pytest.skip(f'this machine stood still for {stood_still() * 1e3:.0f} ms; code {result.code}')
        skip_if_late(f'code {result.code}')
        return result

    return drive


@contextmanager
def machine_watched() -> Iterator[Callable[[], float]]:
    """Yield what returns for how long (s) the machine stood still; 0 where it may not be watched."""
    watch = subprocess.Popen(
        [sys.executable, '-c', WATCH_TIME],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    told: list[str] = []
    try:
        yield lambda: float(told[0] or 0.0)
    finally:
        told.append(watch.communicate()[0])


def lateness_of_machine() -> float:
    """Return by how much (s) the latest of 3000 samples is late in two processes that only keep time."""
    processes = [
        subprocess.Popen([sys.executable, '-c', KEEP_TIME], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    return max(float(process.communicate()[0]) for process in processes)
