"""What the processes of the graph are given besides their parameters."""

import os

import pytest

from mount_bringup.graph import processes
from mount_bringup.graph.nodes import CONTROL, RECORDER, GraphSettings

TELL = (
    'import os; from mount_ros.nodes.starter import take_priority; take_priority(); '
    'print(os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)'
)


def may_be_urgent():
    return os.geteuid() == 0  # others need CAP_SYS_NICE or limits that the test cannot know


@pytest.mark.skipif(not may_be_urgent(), reason='only root may always ask for real time')
@pytest.mark.parametrize(
    ('node', 'priority', 'told'),
    [
        (CONTROL, 10, f'{os.SCHED_FIFO} 10'),
        (CONTROL, 0, f'{os.SCHED_OTHER} 0'),
        (RECORDER, 10, f'{os.SCHED_FIFO} 5'),
        (RECORDER, 1, f'{os.SCHED_FIFO} 1'),
        (RECORDER, 0, f'{os.SCHED_OTHER} 0'),
    ],
)
def test_the_loop_runs_and_the_recorder_behind_it_run_in_real_time(
    tmp_path, monkeypatch, node, priority, told
):
    monkeypatch.setattr(processes, '_program', lambda nodes: TELL)
    settings = GraphSettings(priority=priority)
    process = processes.NodeProcess([node], settings, tmp_path)
    assert process.wait() == 0
    assert process.log_file.read_text().strip() == told
