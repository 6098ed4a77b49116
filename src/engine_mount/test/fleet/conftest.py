"""What several tests of the fleet need."""

import pytest

from engine_mount.fleet import job
from engine_mount.fleet.runner import Done


@pytest.fixture
def inside(monkeypatch):
    """Let tasks of a fleet run in this process; returns the URIs that were read."""
    read = []

    def run_tasks(work, items, **_):
        for place, item in enumerate(items):
            read.append(item.uri)
            yield Done(place, work(item))

    monkeypatch.setattr(job, 'run_tasks', run_tasks)
    return read
