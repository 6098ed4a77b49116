"""Threads of the middleware that spin must not run in real time."""

import os

import pytest

from mount_ros.nodes.scheduling import calm_resending, resending_threads


def test_threads_that_send_again_are_taken_out_of_real_time(context):
    threads = resending_threads()
    assert threads, 'the middleware names its threads otherwise: mount_ros.nodes.scheduling must know'
    try:
        for thread in threads:
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        pytest.skip('real-time scheduling is not permitted here')
    calm_resending()
    assert {os.sched_getscheduler(thread) for thread in threads} == {os.SCHED_OTHER}
