"""Times in little memory: the same numbers to the nanosecond, whatever they are."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from seen_memory import SEEN

from engine_mount.recordings.messages import packed_column
from engine_mount.recordings.messages.compact_times import CompactTimes, compact, together
from engine_mount.recordings.messages.packed_column import PackedColumn

ANY_TIME = st.integers(-(2**63), 2**63 - 1) | st.integers(0, 300)


@pytest.fixture(autouse=True)
def _short_blocks(monkeypatch):
    monkeypatch.setattr(packed_column, 'BLOCK', 8)


def test_any_times_come_back_as_they_were():
    @settings(deadline=None, derandomize=True)
    @given(st.lists(st.lists(ANY_TIME, max_size=20), max_size=5))
    @example([[-1, 2**63 - 1]])  # a step that does not fit into 64 bits
    def check(pieces):
        times = CompactTimes()
        for piece in pieces:
            times.add(np.array(piece, np.int64))
        whole = np.array([time for piece in pieces for time in piece], np.int64)
        assert len(times) == len(whole)
        np.testing.assert_array_equal(times.finished().whole(), whole)
        places = np.arange(len(whole))[::-2]
        np.testing.assert_array_equal(times.at(places), whole[places])
        np.testing.assert_array_equal(times.ordered().whole(), np.sort(whole))
        assert times.rising == bool((whole[1:] >= whole[:-1]).all())
        assert times.strictly_rising == bool((whole[1:] > whole[:-1]).all())

    check()


def test_any_numbers_come_back_to_the_bit():
    @settings(deadline=None, derandomize=True)
    @given(st.lists(st.lists(st.floats() | st.integers(0, 3).map(float), max_size=20), max_size=5))
    def check(pieces):
        column = PackedColumn()
        for piece in pieces:
            column.add(np.array(piece))
        whole = np.array([number for piece in pieces for number in piece])
        assert len(column) == len(whole)
        assert column.finished().whole().tobytes() == whole.tobytes()
        assert all(len(block) <= 8 for block in column.blocks())

    check()


def test_columns_are_looked_at_together_stretch_by_stretch():
    @settings(deadline=None, derandomize=True)
    @given(st.lists(st.lists(st.integers(0, 60), max_size=60), min_size=1, max_size=3))
    def check(columns):
        last = -1
        found = [[] for _ in columns]
        for pieces in together([compact(np.sort(np.array(times, np.int64))) for times in columns]):
            present = [piece for piece in pieces if len(piece)]
            assert min(piece[0] for piece in present) > last
            last = max(piece[-1] for piece in present)
            for place, piece in enumerate(pieces):
                found[place] += piece.tolist()
        assert found == [sorted(set(times)) for times in columns]

    check()


def test_times_of_a_clock_take_two_bytes_each(monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(packed_column, 'mmap', SEEN)
    count = 400_000
    stamps = np.arange(count) * 1_000_000 + np.random.default_rng(3).integers(-50, 50, count)
    tracemalloc.start()
    times = compact(stamps)
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert len(times) == count
    assert 1.0 < kept / count < 3.0  # with the memory that is not yet filled
