"""What the tests share: a short drive without middleware, and free ports."""

import socket
from pathlib import Path

import pytest

from engine_mount.drives.loop.recording import record_core


@pytest.fixture(scope='session')
def drive(tmp_path_factory) -> Path:
    """Return the recording of a drive over a gap: 3 s of rest and ramp, 2 s of motorway."""
    folder = tmp_path_factory.mktemp('view') / 'recording'
    sim = {'scenario': 'motorway', 'timeline.duration': 2.0, 'motorway.gap_time': 0.3}
    session = 'scenario: motorway\nparameters: {mount_control: {policy: continuous_viscous}}\n'
    record_core(folder, {'mount_sim': sim}, session, lambda *_: None)
    return folder


@pytest.fixture
def free_port() -> int:
    """Return a port of this machine that is free now."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        return server.getsockname()[1]
