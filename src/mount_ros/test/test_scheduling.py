"""Threads of the middleware that spin must not run in real time."""

import os
from pathlib import Path

import pytest

from mount_ros.scheduling import calm_resending


def test_threads_that_send_again_are_taken_out_of_real_time(context):
    tasks = [task for task in Path('/proc/self/task').iterdir() if 'dds.asyn' in (task / 'comm').read_text()]
    assert tasks, 'the middleware names its threads otherwise: mount_ros.scheduling must know'
    try:
        for task in tasks:
            os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        pytest.skip('real-time scheduling is not permitted here')
    calm_resending()
    assert {os.sched_getscheduler(int(task.name)) for task in tasks} == {os.SCHED_OTHER}
