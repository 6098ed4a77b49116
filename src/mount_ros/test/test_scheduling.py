"""The names by which the threads of the data are found, and real time that a process was started in."""

import os
import re
import subprocess
import sys

import pytest
from ros_testing import LIMIT

from mount_ros.nodes.scheduling import Threads


def may_be_urgent():
    """Return whether this process may run in real time, tried by a process of its own."""
    program = 'import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(12))'
    return subprocess.run([sys.executable, '-c', program], capture_output=True).returncode == 0


needs_real_time = pytest.mark.skipif(
    not may_be_urgent(),
    reason='SCHED_FIFO is not permitted here: root, CAP_SYS_NICE or RLIMIT_RTPRIO is needed',
)


def test_the_middleware_names_its_threads_as_those_that_carry_the_data_are_told_by(context):
    from rclpy.node import Node

    node = Node('named', context=context)
    names = set(Threads().names().values())
    node.destroy_node()
    for beginning in ('dds.udp.', 'dds.asyn', 'dds.ev'):
        assert any(name.startswith(beginning) for name in names), f'{beginning} is not among {sorted(names)}'
    by_locks = re.compile(r'dds\.shm\.\d+')
    assert not any(map(by_locks.fullmatch, names)), 'data is taken by shared memory, which has locks'


SPINNING = """
import os, threading
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.process import run_nodes

def policy(name):
    thread, = (thread for thread in threading.enumerate() if thread.name == name)
    policy = os.sched_getscheduler(thread.native_id) & ~os.SCHED_RESET_ON_FORK
    return policy, os.sched_getparam(thread.native_id).sched_priority

class Spinning(SafeLifecycleNode):
    def __init__(self):
        super().__init__('spinning')
        self.create_timer(0.02, self._turn)
        self.active_policy = 0, 0
        self.turn = iter(['configure', 'activate'])
    def configure(self):
        self.open_data_path().add_poll(self._spin)
    def _spin(self):
        # By the thread itself: beside it no other one of this node may have a turn until it is stepped down.
        self.active_policy = max(self.active_policy, policy('data'))
        return True  # never sleeps: there is always something to do
    def _turn(self):
        getattr(self, 'trigger_' + next(self.turn, 'nothing'), lambda: None)()
        if self.active and self.real_time.given_back and not self.real_time.held:
            print(self.active_policy, policy('data'), policy('MainThread'), flush=True)
            print(self.sentence, flush=True)
            os.kill(os.getpid(), 15)

run_nodes([Spinning])
"""


@needs_real_time
def test_a_loop_that_spins_in_real_time_is_stepped_down_and_the_process_ends_as_any_other(domain):
    process = subprocess.run(
        [sys.executable, '-c', SPINNING],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain), 'ENGINE_MOUNT_PRIORITY': '10'},
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert process.returncode == 0, process.stderr
    policies, sentence = process.stdout.splitlines()[:2]
    fast, ordinary = (int(os.SCHED_FIFO), 10), (int(os.SCHED_OTHER), 0)
    assert policies == f'{fast} {ordinary} {ordinary}'
    assert sentence.startswith('real-time priority 10 given back: ')
    assert sentence in process.stderr
