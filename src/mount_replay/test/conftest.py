"""What several tests of mount_replay need."""

import pytest

from mount_replay.fleet.catalogue import index as indexing
from mount_replay.fleet.runner import Done
from mount_replay.fleet.what_if import run


@pytest.fixture
def inside(monkeypatch):
    """Let tasks of a fleet run in this process; returns the URIs that were read."""
    read = []

    def run_tasks(work, items, **_):
        for place, item in enumerate(items):
            read.append(item.uri)
            yield Done(place, work(item))

    monkeypatch.setattr(indexing, 'run_tasks', run_tasks)
    monkeypatch.setattr(run, 'run_tasks', run_tasks)
    return read
