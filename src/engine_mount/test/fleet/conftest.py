"""What several tests of engine_mount.drives need."""

import pytest

from engine_mount.fleet.catalogue import index as indexing
from engine_mount.fleet.runner import Done
from engine_mount.fleet.what_if import run


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
