"""How many functions of our own a sample passes in the driver, and its answer: each costs time on the way."""

import itertools
import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from far_end import FarEnd, sample
from rclpy.lifecycle import TransitionCallbackReturn

import mount_driver
import mount_models
import mount_ros
from mount_driver.exchange import Exchange
from mount_driver.node import MountDriver
from mount_driver.protocol import Status
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CURRENT_SETPOINT

OWN = tuple(str(Path(package.__file__).parent) for package in (mount_driver, mount_models, mount_ros))
SAMPLES = 1000
MOST_CALLS = 18  # three of them in mount_ros
MOST_FILES = 9


class Calls:
    """Counts calls of functions under `src`, and of generated ones, from a reception to a transmission."""

    def __init__(self):
        self.of = Counter()
        """By file and function."""
        self._counting = False

    def count(self, function, *arguments):
        """Return what a function returns, which receives from python-can or sends by it."""
        self._counting = bool(arguments)  # what receives first polls the bus
        sys.setprofile(self._look)
        try:
            return function(*arguments)
        finally:
            sys.setprofile(None)

    def _look(self, frame, event, _):
        code = frame.f_code
        if event == 'return' and code.co_name == 'recv':
            self._counting = True
        elif event == 'call' and code.co_name == 'send' and 'can' in Path(code.co_filename).parts:
            self._counting = False
        elif event == 'call' and self._counting and code.co_filename.startswith((*OWN, '<string')):
            self.of[Path(code.co_filename).name, code.co_qualname] += 1


@pytest.fixture
def driver(make_node, monkeypatch):
    """Return an active driver in real time on a virtual bus, whose frames this thread handles."""
    start = Exchange.start

    def start_here(exchange, threaded):
        exchange._steady = itertools.count(10**9, 1000).__next__  # ns: on a busy machine no sample grows old
        start(exchange, threaded=False)

    monkeypatch.setattr(Exchange, 'start', start_here)
    node = make_node(MountDriver, interface='virtual', channel='calls', coil_celsius_before=20.0)
    assert node.trigger_configure() == node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    return node


def wanted(index):
    """Return the current (A) of a ramp, then of damping."""
    return 2.2 * math.sin(math.pi * index / 1000) if index < 1000 else 0.5 + 0.6 * abs(math.sin(index / 20))


def measured(index, current):
    """Return a sample of a coil at 14 V whose inductance falls through 20 mH at 1.5 A."""
    volts, inductance = 14.0 - 2.5 * current, np.interp(current, [0.5, 1.5, 2.5], [0.045, 0.02, 0.008])
    return sample(index, coil_current=current, current_rate=volts / inductance, flux_rate=volts / 0.11808)


def test_a_sample_and_its_answer_pass_few_functions(driver):
    far, calls, layout = FarEnd('virtual', 'calls', 0), Calls(), ScalarsLayout(CURRENT_SETPOINT)
    exchange, current = driver._exchange, 0.0
    for index in range(1000 + SAMPLES):
        if index == 1000:
            calls = Calls()
        far.send(measured(index, current))
        assert calls.count(exchange.poll)
        calls.count(driver._on_setpoint, layout.pack(exchange.link.latest.stamp, (wanted(index),)))
        current = far.setpoint().current
        if index % 100 == 0:
            far.send_status(Status(14.0, 20.0))
            assert exchange.poll()
    far.close()
    assert exchange.link.fault == ''
    assert calls.of['node.py', 'MountDriver._on_sample'] == calls.of['link.py', 'Link.answer'] == SAMPLES
    assert round(calls.of.total() / SAMPLES) <= MOST_CALLS, calls.of.most_common()
    assert len({file for (file, _), number in calls.of.items() if number >= SAMPLES}) <= MOST_FILES
