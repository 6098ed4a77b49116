"""Tasks on processes of this machine and on a cluster: what is lost is run again, what is started ends."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from engine_mount.fleet import runner
from engine_mount.fleet.runner import LOSSES, SchedulerLostError, run_tasks

_COMMAND = """
import os, sys, time
from engine_mount.fleet.runner import run_tasks

def work(place):
    if place < 2:
        return os.getpid()
    time.sleep(600)

if __name__ == '__main__':
    for done in run_tasks(work, range(8), workers=2,):
        print(done.result or done.reason, flush=True)
"""
_PATIENCE = 60.0  # s


def test_all_tasks_are_done_once_by_as_many_processes_as_asked(tmp_path, monkeypatch):
    for module in ('queue', 'runpy', 'yaml'):  # of whoever filled the working directory
        (tmp_path / f'{module}.py').write_text('raise SystemExit("foreign code ran")')
    monkeypatch.chdir(tmp_path)

    def work(place):
        time.sleep(0.05)
        return place**2, os.getpid(), os.nice(0), os.environ['OPENBLAS_NUM_THREADS']

    done = list(run_tasks(work, range(40), workers=2))
    assert sorted(one.place for one in done) == list(range(40))
    assert all(one.result[0] == one.place**2 and one.reason == '' for one in done)
    assert len({one.result[1] for one in done} - {os.getpid()}) == 2
    assert {one.result[2:] for one in done} == {(min(os.nice(0) + 10, 19), '1')}


def test_a_task_that_raises_is_a_result_with_its_reason():
    def work(place):
        if place == 1:
            raise KeyError('gap')
        return place

    done = sorted(run_tasks(work, range(3), workers=1), key=lambda one: one.place)
    assert [one.result for one in done] == [0, None, 2]
    assert done[1].reason == "KeyError: 'gap'"
    assert isinstance(done[1].error, KeyError)


def test_an_error_that_cannot_be_sent_is_told_by_its_words():
    class OddError(Exception):  # of no module
        pass

    def work(place):
        raise OddError('odd')

    (done,) = run_tasks(work, [0], workers=1)
    assert done.reason == 'RuntimeError: OddError: odd'


def test_a_worker_that_is_killed_costs_a_retry_and_a_task_that_kills_its_workers_is_given_up(tmp_path):
    def work(place):
        (tmp_path / f'{place}_{os.getpid()}').touch()
        if place == 3 or (place == 5 and len(list(tmp_path.glob('5_*'))) == 1):
            os.kill(os.getpid(), signal.SIGKILL)
        return place

    done = sorted(run_tasks(work, range(8), workers=2), key=lambda one: one.place)
    assert [one.result for one in done] == [0, 1, 2, None, 4, 5, 6, 7]
    assert done[3].reason == '3 workers were lost with it: killed, or out of memory'
    assert len(list(tmp_path.glob('3_*'))) == LOSSES


def test_nobody_else_can_hand_work_to_the_processes_of_this_machine():
    def work(place):
        time.sleep(0.05)
        return os.getpid()

    def sockets(process):
        return {each.laddr for each in psutil.Process(process).net_connections('inet')}

    before = sockets(os.getpid())
    tasks = run_tasks(work, range(20), workers=2)
    workers = {next(tasks).result for _ in range(10)}
    opened = set().union(*map(sockets, {os.getpid(), *workers})) - before
    tasks.close()
    assert workers
    assert opened == set()


def test_processes_that_cannot_start_end_the_run_with_a_sentence(monkeypatch):
    monkeypatch.setattr(runner, '_serve', divmod)  # it raises
    with pytest.raises(ChildProcessError, match='no worker process could start'):
        list(run_tasks(abs, range(4), workers=1))


def test_workers_that_are_killed_while_they_send_their_results_hold_up_nothing():
    def work(place):
        return b'x' * 1_000_000

    for _ in range(5):
        tasks = run_tasks(work, range(50), workers=2)
        next(tasks)
        begin = time.monotonic()
        tasks.close()
        assert time.monotonic() - begin < _PATIENCE / 10


def test_items_are_not_all_handed_over_at_once():
    class Items(list):
        taken = 0

        def __getitem__(self, place):
            self.taken = max(self.taken, place + 1)
            return super().__getitem__(place)

    items = Items(range(1000))
    results = run_tasks(abs, items, workers=1)
    next(results)
    assert items.taken < 20
    results.close()


@pytest.mark.parametrize(
    'blow',
    [
        signal.SIGKILL,
        *(pytest.param(each, marks=pytest.mark.slow) for each in (signal.SIGINT, signal.SIGTERM)),
    ],
)
def test_no_worker_outlives_the_command(blow, tmp_path):
    with _started(tmp_path) as command:
        workers = [int(command.stdout.readline()) for _ in range(2)]
        os.killpg(command.pid, blow) if blow == signal.SIGINT else command.send_signal(blow)
        command.wait(_PATIENCE)
        _wait_until(lambda: not any(Path(f'/proc/{worker}').exists() for worker in workers))
        if blow == signal.SIGINT:
            told = command.stderr.read()
            assert told.splitlines()[-1] == 'KeyboardInterrupt'
            assert told.count('Traceback') == 1


@pytest.mark.slow
def test_an_address_where_no_scheduler_is_is_refused():
    with pytest.raises(SchedulerLostError, match=r'tcp://127\.0\.0\.1:1: no Dask scheduler answers there'):
        list(run_tasks(abs, [1], scheduler='tcp://127.0.0.1:1'))


@contextlib.contextmanager
def _started(folder):
    """A process of its own group, as a terminal starts it, that runs tasks."""
    script = folder / 'command.py'
    script.write_text(_COMMAND)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _wait_until(condition):
    end = time.monotonic() + _PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
