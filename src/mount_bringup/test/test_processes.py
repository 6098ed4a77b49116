"""What the processes of the graph are given besides their parameters."""

import pytest

from mount_bringup.graph import processes
from mount_bringup.graph.nodes import CONTROL, RECORDER, GraphSettings

TELL = 'from mount_ros.nodes.starter import given_priority; print(given_priority())'


@pytest.mark.parametrize(
    ('node', 'priority', 'told'),
    [(CONTROL, 10, '10'), (CONTROL, 0, '0'), (RECORDER, 10, '5'), (RECORDER, 1, '1'), (RECORDER, 0, '0')],
)
def test_the_loop_is_given_the_priority_and_the_recorder_one_behind_it(
    tmp_path, monkeypatch, node, priority, told
):
    monkeypatch.setattr(processes, '_program', lambda nodes: TELL)
    settings = GraphSettings(priority=priority)
    process = processes.NodeProcess([node], settings, tmp_path)
    assert process.wait() == 0
    assert process.log_file.read_text().strip() == told
