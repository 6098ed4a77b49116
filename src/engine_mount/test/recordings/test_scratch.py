"""Long arrays in files: the same numbers, in memory only where they are looked at."""

import re
from pathlib import Path

import numpy as np
import pytest

from engine_mount.recordings.container import scratch
from engine_mount.recordings.container.scratch import kept, put_away, room

COUNT = 1 << 21


def resident():
    """Return how much of this process is in memory, B."""
    return 1024 * int(re.search(r'VmRSS:\s*(\d+)', Path('/proc/self/status').read_text())[1])


def test_a_long_array_that_was_put_away_holds_its_numbers_and_no_memory():
    copy = kept(1.0 + np.arange(COUNT))
    put_away()
    before = resident()
    assert copy[0] == 1.0
    assert copy.sum() == 0.5 * COUNT * (COUNT + 1)
    looked_at = resident()
    put_away()
    assert looked_at - before > 0.7 * copy.nbytes
    assert resident() - before < 0.3 * copy.nbytes


def test_a_short_array_stays_where_it_is():
    numbers = np.arange(100)
    assert kept(numbers) is numbers
    assert room(100, np.int64).base is None


def test_without_room_for_files_arrays_are_in_memory(monkeypatch):
    def full(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(scratch.os, 'posix_fallocate', full)
    assert np.array_equal(kept(np.arange(COUNT)), np.arange(COUNT))


@pytest.mark.parametrize('kind', [np.float64, np.int64])
def test_a_long_array_is_of_the_kind_that_is_asked_for(kind):
    assert room(COUNT, kind).dtype == kind
