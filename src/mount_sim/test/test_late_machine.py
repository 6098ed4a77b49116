"""A machine that is late is no fault of the coil.

Driver and simulated electronics, ms by ms of a time that the test moves, between them a bus that delays and
loses frames; host and electronics stand still at times and then handle at once what has queued up.
"""

from collections import deque
from unittest.mock import patch

import numpy as np
import pytest
from simulated_mounts import make_mount

from mount_driver.bus import Frame
from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import MountCodec
from mount_models.sampling import HIGHEST_CURRENT
from mount_sim.electronics.can_end import CanEnd
from mount_sim.loop import ElectronicsLoop

CODEC = MountCodec()
MS = 1_000_000
LATE = 1500  # ms with a late machine, then it is quiet
QUIET = 1000  # ms
DELAYS, LONGEST_STALL = (6, 18, 60), 300  # ms; one of the delays is the longest of a run
REGIME = 150  # ms: so long the bus stays as it is
SEEDS = range(40)


class Way:
    """One direction of the bus: `delay` up to so many ms, `loss` the share of lost frames, all in order."""

    def __init__(self, random, now, longest):
        self.random, self.now, self.longest = random, now, longest
        self.delay, self.constant, self.loss = 0, 0, 0.0
        self._frames = deque()
        self._last = 0

    def change(self, late):
        """Become another one, or in time."""
        kind = self.random.integers(5) if late else 0
        self.delay = self.random.integers(self.longest + 1) if kind in (1, 2) else 0
        self.constant = self.random.integers(self.longest + 1) if kind == 3 else 0
        self.loss = self.random.uniform(0.0, 0.5) if kind in (2, 4) else 0.0

    def send(self, frame):
        if self.random.uniform() >= self.loss:
            way = self.constant + (self.random.integers(self.delay + 1) if self.delay else 0)
            self._last = max(self._last, self.now() + way)
            self._frames.append((self._last, Frame(frame.arbitration_id, bytes(frame.data))))

    def take(self):
        return self._frames.popleft()[1] if self._frames and self._frames[0][0] <= self.now() else None


class Bus:
    """What one end sees of the two ways."""

    def __init__(self, out, back):
        self.send, self._back = out.send, back

    def recv(self, timeout):
        return self._back.take()

    def shutdown(self):
        pass


class Worker:
    """Whoever may stand still: `runs` says whether it works in this ms."""

    def __init__(self, random, longest):
        self.random, self.longest = random, longest
        self._until = 0

    def runs(self, now, late):
        if late and now >= self._until and self.random.uniform() < 0.004:
            self._until = now + 1 + self.random.integers(self.longest)
        return not late or now >= self._until


def setpoints(random):
    """Return currents (A) for each ms, changing at a rate of their own."""
    time = 1e-3 * np.arange(LATE + QUIET)
    top, frequency = random.uniform(0.2, HIGHEST_CURRENT), 10.0 ** random.uniform(-0.5, 2.7)
    kind = random.integers(5)
    if kind == 0:
        return random.uniform(0.0, top, len(time))
    if kind == 1:
        return np.where(time * frequency % 1.0 < 0.5, top, 0.0)
    if kind == 2:
        return top * (0.5 + 0.5 * np.sin(2.0 * np.pi * frequency * time))
    if kind == 3:
        return top * np.abs((time * frequency / 50.0) % 2.0 - 1.0)
    return np.full(len(time), top)


class Link:
    """Both ends at work; `run` goes on ms by ms."""

    def __init__(self, mount, random):
        self.now, self.mount, self.wanted = 0, mount, setpoints(random)
        longest = random.choice(DELAYS)
        there, back = (Way(random, lambda: self.now, longest) for _ in range(2))
        self.random, self.ways = random, (there, back)
        self.host, self.electronics = Worker(random, LONGEST_STALL), Worker(random, longest)
        self._loop = ElectronicsLoop(mount, CanEnd(Bus(back, there)), lambda number: None)
        self._answers = deque()  # time, stamp, current
        self._latency = 0
        self.exchange = Exchange(
            DriverParameters(interface='virtual', channel='none'),
            CODEC,
            ElectronicsClock(10**18),
            self._answer,
            steady=lambda: self.now * MS,
        )
        with patch('mount_driver.exchange.open_bus', lambda *args, **options: Bus(there, back)):
            self.exchange.start(threaded=False)

    def run(self, until, late):
        """Return the first ms at which a fault was told, None if none was."""
        while self.now < until:
            self.now += 1
            if self.now % REGIME == 0 or not late:
                for way in self.ways:
                    way.change(late)
                self._latency = self.random.integers(25) if late and self.random.uniform() < 0.5 else 0
            if self.electronics.runs(self.now, late):
                while self.mount.sample < self.now:  # the next sample follows at once: none is skipped
                    self._loop.send_sample()
                    self._loop.go_on()
            if self.host.runs(self.now, late):
                while self.exchange.poll():
                    pass
                while self._answers and self._answers[0][0] <= self.now:
                    self.exchange.send_setpoint(*self._answers.popleft()[1:])
                self.exchange.watch()
            if self.exchange.link.fault:
                return self.now
        return None

    def _answer(self, stamped):
        self._answers.append((self.now + self._latency, stamped.stamp, float(self.wanted[self.now - 1])))


@pytest.fixture
def link():
    made = []

    def make(seed):
        mount = make_mount(timeline__duration=1e-3 * (LATE + QUIET))
        made.append(Link(mount, np.random.default_rng(seed)))
        return made[-1]

    yield make
    for each in made:
        each.exchange.stop()


@pytest.mark.parametrize('seed', SEEDS)
def test_a_sound_coil_is_never_doubted_however_late_frames_and_machines_are(link, seed):
    late = link(seed)
    assert late.run(LATE, late=True) is None, late.exchange.link.fault
    assert late.run(LATE + QUIET, late=False) is None, late.exchange.link.fault
    assert late.exchange.link.status is not None
