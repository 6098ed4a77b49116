"""What a file keeps for its end: on the disk, whole and in order, whatever the disk takes."""

import os

import pytest

from mount_recorder import record_file
from mount_recorder.record_file import RESERVE_STEP, RecordFile

PIECES = [bytes([number % 256]) * (number % 7) for number in range(1000)]


@pytest.fixture
def file(tmp_path):
    file = RecordFile(tmp_path / 'records')
    yield file
    file.close()


def _keep(file):
    for piece in PIECES:
        file.keep(piece)


def test_what_is_kept_lies_in_the_room_and_comes_back_whole_before_and_after_its_release(file):
    file.keep_room(1)
    _keep(file)
    assert not file._kept_here
    assert file.kept() == b''.join(PIECES)
    file.release_room()
    assert file.kept() == b''.join(PIECES)


def test_without_room_it_is_kept_in_memory(file):
    _keep(file)
    assert file.kept() == b''.join(PIECES)


def test_what_the_room_has_no_more_place_for_follows_in_memory(file):
    file.keep_room(1)
    first = b'x' * (RESERVE_STEP - 1000)
    file.keep(first)
    _keep(file)
    assert file._kept_here
    file.keep_room(2 * RESERVE_STEP)  # later pieces must not come before those in memory
    file.keep(b'last')
    assert file.kept() == first + b''.join(PIECES) + b'last'


def test_a_disk_that_takes_half_of_it_or_nothing_loses_nothing(file, monkeypatch):
    file.keep_room(1)
    tried = []

    def pwrite(handle, data, place):
        tried.append(len(data))
        if len(tried) > 600:
            raise OSError('broken')
        return real(handle, data[: len(data) // 2] if len(tried) > 500 else data, place)

    real = os.pwrite
    monkeypatch.setattr(record_file.os, 'pwrite', pwrite)
    _keep(file)
    assert file.kept() == b''.join(PIECES)
