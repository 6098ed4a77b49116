"""Electronics, driver and a node on a virtual bus, by a clock that the test moves."""

import itertools

from far_end import CODEC, FarEnd, sample

from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import Setpoint, Status

MS = 1_000_000
GOOD = 100  # samples that are answered as they should be, before something goes wrong
_channels = itertools.count()


class Steady:
    """A steady clock that stands until somebody moves it."""

    now = 10**9

    def __call__(self):
        return self.now


class Car:
    """Electronics, driver and a node that answers with 3 A, sample by sample."""

    def __init__(self, **parameters):
        self.channel = f'test_car_{next(_channels)}'
        self.now = 0
        self.far = FarEnd('virtual', self.channel, 0)
        self.stamps, self.sent = [], []  # of the samples that arrived; (time, setpoint) on the bus
        self.exchange = Exchange(
            DriverParameters(interface='virtual', channel=self.channel)._replace(**parameters),
            CODEC,
            ElectronicsClock(10**18),
            lambda stamped: self.stamps.append(stamped.stamp),
            steady=lambda: self.now,
        )
        self.exchange.start(threaded=False)

    def drive(self, milliseconds, node, electronics=None):
        """Each ms `electronics(index)` send, the driver takes it and looks at the clock, `node()` answers."""
        for _ in range(milliseconds):
            self.now += MS
            (electronics or self.send_sample)(self.now // MS)
            while self.exchange.poll():
                pass
            node()
            self.look()
            self.now += 1  # what ends behind 20 ms ends here
            self.exchange.watch()
            self.look()
            self.now -= 1

    def send_sample(self, index):
        self.far.send(sample(index, coil_current=self.on_bus().current if self.sent else 0.0))
        if index % 100 == 0:
            self.far.send_status(Status(14.0, 20.0))

    def answer(self):
        """Answer the newest sample with 3 A."""
        self.exchange.send_setpoint(self.stamps[-1], 3.0)

    def look(self):
        """Note what is on the bus."""
        self.sent += [(self.now, setpoint) for setpoint in self.far.setpoints()]

    def on_bus(self):
        """Return the setpoint that stands on the bus."""
        return self.sent[-1][1]

    def off_since(self):
        """Return since when (ns) every frame has `Enable` 0."""
        enabled = [k for k, (_, setpoint) in enumerate(self.sent) if setpoint.enable]
        return self.sent[enabled[-1] + 1][0]

    def went_off(self):
        """Return how long after the last good sample the current went to 0 A for good."""
        current = [index for index, (_, setpoint) in enumerate(self.sent) if setpoint.current > 0.0]
        assert len(current) == GOOD
        time, off = self.sent[current[-1] + 1]
        assert off == Setpoint(0.0, GOOD, False)
        return time - GOOD * MS
