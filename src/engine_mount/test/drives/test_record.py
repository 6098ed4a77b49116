"""A recorder without a graph refuses before it starts."""

import pytest

from engine_mount.drives import record
from engine_mount.recordings.screen import Screen
from mount_bringup.graph.nodes import GraphError
from mount_recorder.parameters import RecorderParameters
from mount_ros import environment


def test_no_recording_begins_where_the_loopback_interface_is_down(tmp_path, monkeypatch):
    monkeypatch.setattr(environment, '_NEIGHBOUR', ('255.255.255.255', 9))  # refused without a flag
    with pytest.raises(GraphError, match=r'^the loopback interface is down'):
        record.record(tmp_path / 'out', RecorderParameters(), Screen())
    assert not (tmp_path / 'out').exists()
