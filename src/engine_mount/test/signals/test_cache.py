"""Copies: bounded, the one used longest ago goes first, never one in use."""

import os
import subprocess
import sys
from collections import namedtuple

import pytest

from engine_mount.signals.sources import cache as module
from engine_mount.signals.sources.cache import Cache, default_folder, default_limit
from engine_mount.signals.sources.source import SourceError

HOLD = """
import sys
from pathlib import Path
from engine_mount.signals.sources.cache import Cache
Cache(Path(sys.argv[1]), 100).hold('a', 'a.bin', 60, lambda part: None, None)
print('held', flush=True)
sys.stdin.read()
"""
Usage = namedtuple('Usage', 'total used free')


@pytest.fixture
def cache(tmp_path):
    return Cache(tmp_path / 'copies', 100)


def hold(cache, key, size):
    """Hold the copy `key` of `size` bytes, and let it have been used later than all others."""
    held = cache.hold(
        key,
        f'{key}.bin',
        size,
        lambda part: None,
        lambda part: (part / f'{key}.bin').write_bytes(bytes(size)),
    )
    hold.clock += 1
    os.utime(held.path.parent.parent / 'lock', (hold.clock, hold.clock))
    return held


hold.clock = 1_700_000_000


def present(cache):
    return {path.name.removesuffix('.bin') for path in cache.folder.rglob('*.bin')}


def test_what_was_used_longest_ago_goes_first(cache):
    for key in 'abc':
        hold(cache, key, 30).release()
    cache.hold('a', 'a.bin', 30, lambda part: None, lambda part: None).release()  # takes the time of today
    hold(cache, 'd', 30).release()
    assert present(cache) == set('acd')


def test_no_more_goes_than_has_to(cache):
    for key in 'abc':
        hold(cache, key, 30).release()
    hold(cache, 'd', 10).release()
    assert present(cache) == set('abcd')


def test_what_is_in_use_stays(cache):
    kept = hold(cache, 'a', 60)
    hold(cache, 'b', 30).release()
    hold(cache, 'c', 40).release()
    assert present(cache) == set('ac')
    with pytest.raises(SourceError, match=r'needed in .* may hold 0.1 kB and has 0.1 kB in use.*CACHE_LIMIT'):
        hold(cache, 'd', 60)
    assert present(cache) == {'a'}
    kept.release()
    hold(cache, 'd', 60).release()
    assert present(cache) == {'d'}


def test_what_another_process_uses_stays_until_it_ends(cache):
    hold(cache, 'a', 60).release()
    command = [sys.executable, '-c', HOLD, str(cache.folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == 'held\n'
        with pytest.raises(SourceError, match='in use'):
            hold(cache, 'b', 60)
        other.kill()
    hold(cache, 'b', 60).release()
    assert present(cache) == {'b'}


def test_what_is_larger_than_all_copies_may_be_is_refused(cache):
    with pytest.raises(SourceError, match='ENGINE_MOUNT_CACHE_LIMIT'):
        hold(cache, 'a', 101)
    assert not present(cache)


def test_room_on_the_disk_is_made_by_removing_copies(cache, monkeypatch):
    cache.limit = 1000
    for key in 'ab':
        hold(cache, key, 60).release()
    free = lambda folder: Usage(0, 0, module._SPARE + 100 - 60 * (len(present(cache)) - 1))  # noqa: E731
    monkeypatch.setattr(module.shutil, 'disk_usage', free)
    hold(cache, 'c', 60).release()
    assert present(cache) == set('bc')


def test_a_full_disk_is_told_with_what_is_needed_and_free(cache, monkeypatch):
    monkeypatch.setattr(module.shutil, 'disk_usage', lambda folder: Usage(0, 0, 2_000_000))
    cache.limit = 10**10
    with pytest.raises(SourceError, match=r'5\.0 GB are needed in .*, 2\.0 MB are free.*ENGINE_MOUNT_CACHE'):
        cache.hold('a', 'a.bin', 5 * 10**9, lambda part: None, None)
    assert not present(cache)


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(SourceError, match=r'cannot be written: .*ENGINE_MOUNT_CACHE'):
        hold(Cache(tmp_path / 'file' / 'copies', 100), 'a', 1)


def test_what_was_half_removed_is_not_taken_for_whole(cache, monkeypatch):
    hold(cache, 'a', 60).release()

    def remove_half(place, **how):
        if not how:  # of a copy, not of what a process left that was killed
            for file in place.rglob('*.bin'):
                file.unlink()
            raise OSError('killed')

    with monkeypatch.context() as patch:
        patch.setattr(module.shutil, 'rmtree', remove_half)
        with pytest.raises(SourceError):
            hold(cache, 'b', 60)
    assert hold(cache, 'a', 60).path.read_bytes() == bytes(60)


def test_what_fails_leaves_nothing(cache):
    def fill(part):
        (part / 'a.bin').write_bytes(b'half')
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cache.hold('a', 'a.bin', 10, lambda part: None, fill)
    assert not present(cache)
    assert hold(cache, 'a', 10).path.read_bytes() == bytes(10)


def test_folder_and_limit_are_chosen_by_the_environment(monkeypatch, own_home):
    assert default_folder() == own_home / 'copies'
    assert default_limit() == 20 * 10**9
    monkeypatch.setenv('ENGINE_MOUNT_CACHE_LIMIT', '500MB')
    assert default_limit() == 500 * 10**6
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', '')
    assert default_folder() == own_home / 'cache' / 'engine_mount' / 'recordings'
    monkeypatch.setenv('ENGINE_MOUNT_CACHE_LIMIT', 'much')
    with pytest.raises(ValueError, match='much'):
        default_limit()
