"""The worker's side of many tasks: some of them in turn, in a process that yields, ends and stays small."""

import contextlib
import ctypes
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')

_NICENESS = 10  # chosen: who works at the machine comes first
_CHECK = 0.1  # s, chosen: between two measurements of the memory
_PR_SET_PDEATHSIG = 1  # Linux, linux/prctl.h
_PAGE = os.sysconf('SC_PAGE_SIZE')  # bytes


class WorkerLostError(Exception):
    """The worker of a task was lost."""


@dataclass(frozen=True)
class Batch(Generic[Result]):
    """What came of the first of several tasks, in `seconds`; `error` is what the last of these raised."""

    results: list[Result]
    error: Exception | None
    seconds: float


def run_in_turn(work: Callable[[Item], Result], items: Sequence[Item]) -> Batch[Result]:
    """Do several tasks at a worker, up to the first that raises."""
    begin = time.monotonic()
    results: list[Result] = []
    for item in items:
        try:
            result = work(item)
        except Exception as error:  # whatever it is, it is told as what became of its task
            return Batch(results, _portable(error), time.monotonic() - begin)
        results.append(result)
    return Batch(results, None, time.monotonic() - begin)


def serve(pipe: Connection, starter: int, memory: int) -> None:
    """Do pickled tasks from a pipe, one after the other, until it is closed."""
    prepare_worker(starter, memory)
    pipe.send(None)  # it has begun to work
    with contextlib.suppress(EOFError):
        while True:
            task = pipe.recv_bytes()
            try:
                answer = pickle.dumps(run_in_turn(*pickle.loads(task)))
            except Exception as error:  # a task that cannot be loaded, a result that cannot be sent
                answer = pickle.dumps(_portable(error))
            pipe.send_bytes(answer)


def prepare_worker(starter: int, memory: int) -> None:
    """Tie this process to its starter, let it yield, and end it beyond `memory` bytes."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != starter:  # it ended before
        os.kill(os.getpid(), signal.SIGKILL)
    os.nice(_NICENESS)
    threading.Thread(target=_limit_memory, args=(memory,), name='memory', daemon=True).start()


def _limit_memory(memory: int) -> None:
    """Kill this process once it holds more than `memory` bytes: the runner counts it as lost."""
    while _resident() <= memory:
        time.sleep(_CHECK)
    os.kill(os.getpid(), signal.SIGKILL)


def _resident() -> int:
    """Return the bytes of this process in memory, proc(5)."""
    with open('/proc/self/statm', encoding='ascii') as file:
        return int(file.read().split()[1]) * _PAGE


def _portable(error: Exception) -> Exception:
    """Return an error, or where it cannot be sent to another process one with its words."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # what an error of others raises there is not known
        return RuntimeError(f'{type(error).__name__}: {error}')
    return error
