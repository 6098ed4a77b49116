"""Tasks on processes of this machine and on a cluster: what is lost is run again, what is started ends."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

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
    for done in run_tasks(work, range(8), workers=2, **eval(sys.argv[1])):
        print(done.result or done.reason, flush=True)
"""
_PATIENCE = 60.0  # s


def test_all_tasks_are_done_once_by_as_many_processes_as_asked(tmp_path, monkeypatch):
    for module in ('queue', 'runpy', 'yaml'):  # of whoever filled the working directory
        (tmp_path / f'{module}.py').write_text('raise SystemExit("foreign code ran")')
    monkeypatch.chdir(tmp_path)

    def work(place):
        time.sleep(0.05)
        memory = os.environ.get('MALLOC_TRIM_THRESHOLD_', 'as any process')
        return place**2, os.getpid(), os.nice(0), os.environ['OPENBLAS_NUM_THREADS'], memory

    done = list(run_tasks(work, range(40), workers=2))
    assert sorted(one.place for one in done) == list(range(40))
    assert all(one.result[0] == one.place**2 and one.reason == '' for one in done)
    assert len({one.result[1] for one in done} - {os.getpid()}) == 2
    assert {one.result[2:] for one in done} == {(min(os.nice(0) + 10, 19), '1', 'as any process')}


def test_nothing_to_do_starts_nothing():
    assert list(run_tasks(abs, [], scheduler='tcp://127.0.0.1:1')) == []


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


def test_a_worker_that_is_killed_costs_a_retry(tmp_path):
    first = tmp_path / 'first'

    def work(place):
        if place == 5 and not first.exists():
            first.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return place

    done = list(run_tasks(work, range(12), workers=2))
    assert sorted(one.result for one in done) == list(range(12))


def test_a_task_that_kills_its_workers_is_given_up_and_no_other_one_is(tmp_path):
    def work(place):
        (tmp_path / f'{place}_{os.getpid()}').touch()
        if place == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return place

    done = sorted(run_tasks(work, range(6), workers=2), key=lambda one: one.place)
    assert [one.result for one in done] == [0, 1, 2, None, 4, 5]
    assert done[3].reason == '3 workers were lost with it: killed, or out of memory'
    assert len(list(tmp_path.glob('3_*'))) == LOSSES


def test_nobody_else_can_hand_work_to_the_processes_of_this_machine():
    def work(place):
        time.sleep(0.05)
        return os.getpid()

    before = {os.getpid(): sockets_of(os.getpid())}
    tasks = run_tasks(work, range(20), workers=2)
    workers = {next(tasks).result for _ in range(10)}
    opened = {
        process: sockets_of(process) - before.get(process, set()) for process in {os.getpid(), *workers}
    }
    tasks.close()
    assert workers
    assert set().union(*opened.values()) == set()


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
    with _started(tmp_path, '{}') as command:
        workers = [int(command.stdout.readline()) for _ in range(2)]
        os.killpg(command.pid, blow) if blow == signal.SIGINT else command.send_signal(blow)
        command.wait(_PATIENCE)
        _wait_until(lambda: not any(Path(f'/proc/{worker}').exists() for worker in workers))
        if blow == signal.SIGINT:
            told = command.stderr.read()
            assert told.splitlines()[-1] == 'KeyboardInterrupt'
            assert told.count('Traceback') == 1


def test_a_cluster_by_its_address_does_the_same(cluster):
    address, _ = cluster
    done = list(run_tasks(abs, range(-20, 0), scheduler=address))
    assert sorted(one.result for one in done) == list(range(1, 21))


def test_a_scheduler_that_is_lost_ends_the_run_with_what_was_done(cluster, tmp_path):
    address, scheduler = cluster
    with _started(tmp_path, repr({'scheduler': address})) as command:
        results = [int(command.stdout.readline()) for _ in range(2)]
        assert all(results)
        scheduler.kill()
        command.wait(_PATIENCE)
        told = command.stderr.read()
        assert 'SchedulerLostError: the scheduler' in told.splitlines()[-1]
        assert told.count('Traceback') == 1


@pytest.mark.slow
def test_an_address_where_no_scheduler_is_is_refused():
    with pytest.raises(SchedulerLostError, match=r'tcp://127\.0\.0\.1:1: no Dask scheduler answers there'):
        list(run_tasks(abs, [1], scheduler='tcp://127.0.0.1:1'))


@pytest.fixture
def cluster(tmp_path):
    """Any Dask cluster, of a scheduler and a worker: the address, and the scheduler's process."""
    told = tmp_path / 'scheduler.json'
    options = ['--no-dashboard', '--host', '127.0.0.1', '--port', '0', '--scheduler-file', str(told)]
    with contextlib.ExitStack() as stack:
        scheduler = _process(stack, 'scheduler', *options)
        _wait_until(told.exists)
        _process(stack, 'worker', '--no-dashboard', '--scheduler-file', str(told), '--nthreads', '1')
        yield json.loads(told.read_text())['address'], scheduler


def sockets_of(process):
    """Return the TCP and UDP sockets (inodes) that a process holds."""
    inodes = set()
    for descriptor in Path(f'/proc/{process}/fd').iterdir():
        with contextlib.suppress(OSError):
            inodes.update(re.findall(r'socket:\[(\d+)\]', os.readlink(descriptor)))
    tables = [Path(f'/proc/net/{kind}') for kind in ('tcp', 'tcp6', 'udp', 'udp6')]
    of_network = {line.split()[9] for table in tables for line in table.read_text().splitlines()[1:]}
    return inodes & of_network


def _process(stack, kind, *arguments):
    command = [sys.executable, '-m', 'distributed.cli.dask_' + kind, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


@contextlib.contextmanager
def _started(folder, options):
    """A process of its own group, as a terminal starts it, that runs tasks."""
    script = folder / 'command.py'
    script.write_text(_COMMAND)
    process = subprocess.Popen(
        [sys.executable, str(script), options],
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
