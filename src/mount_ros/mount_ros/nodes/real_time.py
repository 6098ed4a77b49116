"""Real-time priority of the threads that carry the 1 kHz data of a process, and what bounds it.

The threads have it while a node is active, and behind them those that take turns with them: a thread that
holds the interpreter and waits for a processor holds up the loop, whatever the loop's priority. (Sixteen
threads wanted to run on two cores; the loop came up to 140 ms late beside an ordinary thread of its process,
97 ms beside one of niceness -15, and 5 ms beside one in real time.) The memory of the process is kept in
place from its start on (`scheduling`).

A watch gives the priority back, for all of them until an activation after 30 s or more, when
one of them used more than its share of a core: a loop that spins, or more work than the machine carries. The
watch runs above them and sleeps. It is Python and needs the interpreter: where a thread in C keeps that,
or threads in C spin on all cores while another one has it, the system's own bound (RLIMIT_RTTIME) ends the
process; the electronics then go to 0 A by their own watch.
"""

import math
import re
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from mount_ros.nodes.scheduling import Threads, limit_without_sleep

HIGHEST = 98  # of SCHED_FIFO's 99, for the watch runs above
WATCH_PERIOD = 0.2  # s, chosen
_REST = 30.0  # s, chosen: no activation takes it again meanwhile, else restarts keep the machine busy
_WINDOW = 1.0  # s, chosen
_SHARE = 0.8  # of a core, chosen: the simulator, the largest, takes 0.3 at 1 kHz
_LAST = 3.0  # s of processor time between two sleeps, chosen: then the process is killed
# Threads of Fast DDS that take data and call its readers. By the rule of RTPS for ports (7400 + 250 domain
# + 11 + 2 participant) theirs are odd, those of discovery even.
_MIDDLEWARE = re.compile(r'dds\.udp\.\d*[13579]')


class RealTimeThreads(NamedTuple):
    """The threads of a node that work in real time while it is active, besides those of the middleware."""

    names: frozenset[str]
    interpreter: bool = True
    """Whether it cannot wait 0.1 s for the interpreter: threads that take turns with it come behind it."""


class RealTime:
    """Gives the threads of active nodes their priority, looks after it, and gives it back."""

    def __init__(
        self, priority: int, threads: Threads | None = None, clock: Callable[[], float] = time.monotonic
    ):
        self.priority = min(priority, HIGHEST)
        """Of SCHED_FIFO; 0: none is ever taken, or the system does not permit it."""
        self.given_back = ''
        """Why the priority was given back since the last activation, with value, limit and remedy."""
        self.memory_locked = False
        """Whether the system may not take memory of this process away."""
        self._threads = threads or Threads()
        self._clock = clock
        self._watcher = threading.get_native_id()
        self._loops: list[Any] = []
        self._ordinary_until = -math.inf  # s
        self._held: dict[int, int] = {}  # thread: priority
        self._guard = threading.RLock()
        self._used: tuple[float, dict[int, float]] = (-math.inf, {})
        """When the processor time of each thread with the priority was taken, and what it was, s."""

    @property
    def held(self) -> int:
        """The priority at which threads run at present; 0: none does."""
        return self.priority if self._held else 0

    def begin(self, loop: Any) -> None:
        """Give the threads of `loop` their priority, those too that it will make while it is active."""
        with self._guard:
            if not self.priority or loop in self._loops:
                return
            self._loops.append(loop)
            if self._clock() >= self._ordinary_until:
                self.given_back = ''
            limit_without_sleep(_LAST)
            self._give()

    def end(self, loop: Any) -> None:
        """Take it back from the threads that no other active node of the process has in it."""
        with self._guard:
            if loop in self._loops:
                self._loops.remove(loop)
                self._give()

    def check(self) -> str:
        """Look after the priority, once per `WATCH_PERIOD`; return why it was just given back, if it was."""
        with self._guard:
            if not self._loops or self.given_back:
                return ''
            self._give()
            now, (begin, before) = self._clock(), self._used
            if now - begin < _WINDOW:
                return ''
            used = {number: self._threads.processor_time(number) for number in self._held}
            self._used = now, used
            for number in before.keys() & used.keys():
                share = (used[number] - before[number]) / (now - begin)
                if share > _SHARE:
                    thread = self._threads.names().get(number, str(number))
                    return self._give_back(f'{thread} used {share:.2f} of a core in {now - begin:.1f} s')
            return ''

    def _give_back(self, use: str) -> str:
        self._ordinary_until = self._clock() + _REST
        self.given_back = (
            f'real-time priority {self.priority} given back: thread {use} (limit {_SHARE:g}); lower '
            f'the load of this machine or the number of its graphs, then activate again, not before '
            f'{_REST:g} s'
        )
        self._give()
        return self.given_back

    def _give(self) -> None:
        """Let the threads of the loops, and no others, have the priority."""
        wanted = self._wanted() if self._loops and not self.given_back else {}
        try:
            for number, priority in wanted.items() - self._held.items():
                self._threads.run(number, priority)
        except PermissionError:
            self.priority, wanted = 0, {}
        # The watch, the highest, last: a thread that spins would else keep it from the processor.
        for number in sorted(self._held.keys() - wanted.keys(), key=self._held.__getitem__):
            self._threads.run(number, 0)
        self._held = wanted

    def _wanted(self) -> dict[int, int]:
        """Return {thread: priority}."""
        every = [loop.real_time_threads for loop in self._loops]
        own = frozenset[str]().union(*(each.names for each in every))
        wanted = {}
        if any(each.interpreter for each in every):
            wanted = dict.fromkeys(self._threads.of_python(), max(1, self.priority - 1))
        for number, name in self._threads.names().items():
            if name in own or _MIDDLEWARE.fullmatch(name):
                wanted[number] = self.priority
        return {**wanted, self._watcher: self.priority + 1}
