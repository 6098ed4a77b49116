"""Changes a process under test by what a file says: steps of the clocks that it reads, a control that hangs.

On the PYTHONPATH of that process. `time.time`, `time.time_ns` and `rclpy.clock.Clock.now` of the system's
clocks go on by the first number of the file (ns); the machine's clock is left alone, and what the middleware
reads in C++ (its own time stamps) too. Each step of a control lasts longer by the second one (ns).
"""

import importlib.abc
import importlib.machinery
import mmap
import os
import struct
import sys
import time
from typing import Any


def _install(file):
    with open(file, 'rb') as opened:
        content = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)

    def numbers():
        return struct.unpack_from('<qq', content)  # step of the clocks, pause of the control

    read, read_ns = time.time, time.time_ns
    time.time = lambda: read() + 1e-9 * numbers()[0]
    time.time_ns = lambda: read_ns() + numbers()[0]

    def change_clock(module):
        now, steady = module.Clock.now, module.ClockType.STEADY_TIME

        def stepped(clock):
            read = now(clock)
            if clock.clock_type == steady:
                return read
            return module.Time(nanoseconds=read.nanoseconds + numbers()[0], clock_type=clock.clock_type)

        module.Clock.now = stepped

    def change_control(module):
        step = module.ControlLoop.step

        def hanging(loop, *sample):
            if pause := numbers()[1]:
                time.sleep(1e-9 * pause)
            return step(loop, *sample)

        module.ControlLoop.step = hanging

    changes = {'rclpy.clock': change_clock, 'mount_control.control_loop': change_control}
    sys.meta_path.insert(0, _Finder(changes))


class _Finder(importlib.abc.MetaPathFinder):
    """Changes modules when they are imported: {name: change}."""

    def __init__(self, changes):
        self._changes = changes

    def find_spec(self, name, path=None, target=None):
        if name not in self._changes:
            return None
        spec: Any = importlib.machinery.PathFinder.find_spec(name, path)
        execute, change = spec.loader.exec_module, self._changes[name]

        def execute_changed(module):
            execute(module)
            change(module)

        spec.loader.exec_module = execute_changed
        return spec


if file := os.environ.get('ENGINE_MOUNT_SHIM'):
    _install(file)
