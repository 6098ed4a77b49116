"""Steps the clocks that Python reads in a process under test; the machine's clock is left alone.

On the PYTHONPATH of that process. `time.time`, `time.time_ns` and `rclpy.clock.Clock.now` of the system's
clocks go on by what the file says; what the middleware reads in C++ (its own time stamps) does not.
"""

import importlib.abc
import importlib.machinery
import mmap
import os
import struct
import sys
import time

_STEP = struct.Struct('<q')
_CLOCK = 'rclpy.clock'


def _install(file):
    with open(file, 'rb') as opened:
        content = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)

    def step():
        return _STEP.unpack_from(content)[0]

    read, read_ns = time.time, time.time_ns
    time.time = lambda: read() + 1e-9 * step()
    time.time_ns = lambda: read_ns() + step()
    sys.meta_path.insert(0, _ClockFinder(step))


class _ClockFinder(importlib.abc.MetaPathFinder):
    """Changes the clock of rclpy when that is imported."""

    def __init__(self, step):
        self._step = step

    def find_spec(self, name, path=None, target=None):
        if name != _CLOCK:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _ClockLoader(spec.name, spec.origin, self._step)
        return spec


class _ClockLoader(importlib.machinery.SourceFileLoader):
    def __init__(self, name, path, step):
        super().__init__(name, path)
        self._step = step

    def exec_module(self, module):
        super().exec_module(module)
        step, now, steady = self._step, module.Clock.now, module.ClockType.STEADY_TIME

        def stepped(clock):
            read = now(clock)
            if clock.clock_type == steady:
                return read
            return module.Time(nanoseconds=read.nanoseconds + step(), clock_type=clock.clock_type)

        module.Clock.now = stepped


if file := os.environ.get('ENGINE_MOUNT_CLOCK_STEP'):
    _install(file)
