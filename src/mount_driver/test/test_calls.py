"""How many functions of our own a sample passes in the driver, and its answer: each costs time on the way."""

import math
import sys
from collections import Counter
from pathlib import Path

import pytest
from far_end import FarEnd, ripple, sample
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter

from mount_driver.node import MountDriver
from mount_driver.protocol import Status
from mount_ros.data_path import DataPath
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CURRENT_SETPOINT

OWN = str(Path(__file__).parents[2])
SAMPLES = 1000
MOST_CALLS = 20
MOST_FILES = 9


class Calls:
    """Counts calls of functions under `src`, and of generated ones, between a reception and a transmission."""

    def __init__(self):
        self.of = Counter()
        self.files = set()
        self._counting = False

    def look(self, frame, event, _):
        code = frame.f_code
        if event == 'return' and code.co_name == 'recv':
            self._counting = True
        elif event == 'call' and code.co_name == 'send' and 'can' in Path(code.co_filename).parts:
            self._counting = False
        elif event == 'call' and self._counting and code.co_filename.startswith((OWN, '<string')):
            self.of[code.co_qualname] += 1
            self.files.add(Path(code.co_filename).name)


@pytest.fixture
def driver(context, monkeypatch):
    """Return an active driver on a virtual bus, whose frames this thread handles."""
    monkeypatch.setattr(DataPath, 'add_poll', lambda path, poll: None)
    values = {'interface': 'virtual', 'channel': 'calls', 'lockstep': True, 'coil_celsius_before': 20.0}
    node = MountDriver(
        context=context, parameter_overrides=[Parameter(name, value=value) for name, value in values.items()]
    )
    assert node.trigger_configure() == node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    yield node
    node.close()
    node.destroy_node()


def wanted(index):
    """Return the current (A) of a ramp, then of damping."""
    return 2.2 * math.sin(math.pi * index / 1000) if index < 1000 else 0.5 + 0.6 * abs(math.sin(index / 20))


def test_a_sample_and_its_answer_pass_few_functions(driver):
    far, calls, layout = FarEnd('virtual', 'calls', 0), Calls(), ScalarsLayout(CURRENT_SETPOINT)
    exchange, current = driver._exchange, 0.0
    for index in range(1000 + SAMPLES):
        far.send(sample(index, coil_current=current, **ripple(current)))
        if index == 1000:
            sys.setprofile(calls.look)
        assert exchange.poll()
        driver._on_setpoint(layout.pack(index * 1_000_000, (wanted(index),)))
        current = far.setpoint().current
        if index % 100 == 0:
            sys.setprofile(None)
            far.send_status(Status(14.0, 20.0))
            assert exchange.poll()
            sys.setprofile(calls.look if index >= 1000 else None)
    sys.setprofile(None)
    far.close()
    assert exchange.link.fault == ''
    assert calls.of['MountDriver._on_sample'] == calls.of['Link.answer'] >= SAMPLES - 10
    assert calls.of.total() <= MOST_CALLS * SAMPLES, calls.of.most_common()
    assert len(calls.files) <= MOST_FILES, calls.files
