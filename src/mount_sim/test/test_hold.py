"""Whatever of the past is sent again, the true current of the coil is told to be 0 A within 20 ms.

Driver and simulated electronics on one virtual bus, sample by sample, by a steady clock that the test moves.
"""

import itertools

import pytest
from simulated_mounts import make_mount

from mount_driver.bus import Frame, open_bus
from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import MountCodec, Setpoint
from mount_sim.electronics.can_end import CanEnd
from mount_sim.loop import ElectronicsLoop

CODEC = MountCodec()
MS = 1_000_000
GOOD = 100  # samples that are answered as they should be; the answer to the last acts from sample 100 on
HOLD = 20  # samples
_channels = itertools.count()


class Car:
    """Electronics, driver and a node that answers with 3 A; `setpoints[k]` led the coil up to k."""

    def __init__(self, mount):
        self.channel = f'test_hold_of_electronics_{next(_channels)}'
        self.mount, self.now = mount, 0
        self.stamps, self.setpoints = [], []
        self._end = CanEnd(self.bus())
        self._loop = ElectronicsLoop(
            mount,
            self._end,
            lambda number: self.setpoints.append(mount.truth['current_setpoint']),
        )
        self._tap = self.bus()  # hears what the driver sends
        self.last_frame = None
        self.exchange = Exchange(
            DriverParameters(interface='virtual', channel=self.channel),
            CODEC,
            ElectronicsClock(10**18),
            lambda stamped: self.stamps.append(stamped.stamp),
            steady=lambda: self.now,
        )
        self.exchange.start(threaded=False)

    def bus(self):
        return open_bus('virtual', self.channel)

    def drive(self, samples, node, driver_lives=True):
        """Take samples; behind each the driver sees it, `node()` publishes, the driver looks at the clock."""
        for _ in range(samples):
            self.now += MS
            self._loop.send_sample()
            self._loop.go_on()
            while driver_lives and self.exchange.poll():
                pass
            node()
            if driver_lives:
                self.exchange.watch()
            while (frame := self._tap.recv(0.0)) is not None:
                if frame.arbitration_id == CODEC.setpoint.frame_id:
                    self.last_frame = frame

    def answer(self):
        self.exchange.send_setpoint(self.stamps[-1], 3.0)

    def held(self):
        """Return for how many samples the coil was told to follow the last good answer."""
        assert all(current == 3.0 for current in self.setpoints[2 : GOOD + 1])
        behind = [index for index, current in enumerate(self.setpoints) if current > 0.0]
        assert behind == list(range(behind[0], behind[-1] + 1)), 'the current came back'
        return behind[-1] - GOOD

    def close(self):
        self.exchange.stop()
        self._end.close()
        self._tap.shutdown()


@pytest.fixture
def car():
    made = Car(make_mount(timeline__duration=4.0))
    made.drive(GOOD, made.answer)
    yield made
    made.close()


def test_a_frozen_node(car):
    frozen = car.stamps[-1]
    car.drive(3000, lambda: car.exchange.send_setpoint(frozen, 3.0))
    assert car.held() == HOLD


def test_a_frozen_frame_of_a_dead_driver(car):
    """A gateway repeats the last frame that it heard, every ms, for 3 s."""
    frozen, gateway = car.last_frame, car.bus()
    car.drive(3000, lambda: gateway.send(frozen), driver_lives=False)
    assert car.held() == HOLD
    gateway.shutdown()


def test_a_frozen_frame_whose_counter_lives(car):
    """A CAN controller that counts by itself repeats the content of the last frame."""
    gateway, alive = car.bus(), itertools.count(GOOD)
    frozen = CODEC.setpoint.decode(car.last_frame.data)[1]

    def repeat():
        data = CODEC.encode_setpoint(frozen, next(alive) & 0xFF)
        gateway.send(Frame(CODEC.setpoint.frame_id, data))

    car.drive(3000, repeat, driver_lives=False)
    assert car.held() == HOLD
    gateway.shutdown()


def test_a_driver_that_stood_still_and_answers_what_lay_in_its_queue(car):
    """To it the samples of 500 ms arrive now; how old they are only the electronics know."""
    held_back, gateway, alive = [], car.bus(), itertools.count(GOOD)
    frozen = CODEC.setpoint.decode(car.last_frame.data)[1]
    car.drive(500, lambda: None, driver_lives=False)
    for counter in range(GOOD, GOOD + 400):
        data = CODEC.encode_setpoint(frozen._replace(answered_counter=counter), next(alive) & 0xFF)
        held_back.append(Frame(CODEC.setpoint.frame_id, data))
    for frame in held_back:
        gateway.send(frame)
        car.drive(1, lambda: None, driver_lives=False)
    assert car.held() == HOLD
    gateway.shutdown()


class Host:
    """Sends setpoints that answer the newest sample, with counters of its own from `first` on."""

    def __init__(self, car, first, current):
        self._car, self._bus, self._alive, self._current = car, car.bus(), itertools.count(first), current

    def send(self):
        setpoint = Setpoint(self._current, (self._car.mount.sample - 1) & 0xFFFF, True)
        data = CODEC.encode_setpoint(setpoint, next(self._alive) & 0xFF)
        self._bus.send(Frame(CODEC.setpoint.frame_id, data))

    def close(self):
        self._bus.shutdown()


@pytest.mark.parametrize(('every', 'first'), [(1, 77), (3, 77), (10, 77), (1, GOOD)])
def test_electronics_that_hear_two_hosts_are_at_0_ampere_until_one_was_quiet_for_1_s(car, every, first):
    """A second host with few frames, or with the counters of the first one, would not end the current."""
    one, other = Host(car, GOOD, 2.0), Host(car, first, 1.0)
    begin = len(car.setpoints)

    def both():
        if car.mount.sample % every == 0:
            other.send()
        one.send()

    car.drive(400, both, driver_lives=False)
    assert set(car.setpoints[begin + 5 * every + 5 :]) == {0.0}
    car.drive(980, one.send, driver_lives=False)
    assert set(car.setpoints[begin + 5 * every + 5 :]) == {0.0}
    car.drive(100, one.send, driver_lives=False)
    assert car.setpoints[-1] == 2.0
    one.close()
    other.close()
