"""Copies: of limited size, the one used longest ago removed first, never one in use, never half of one."""

import os
import subprocess
import sys

import pytest

from engine_mount.signals.sources import cache
from engine_mount.signals.sources.uris import SourceError

HOLD = """
import sys
from engine_mount.signals.sources.cache import cached_copy
with cached_copy('a', 'a.bin', 60, None):
    print('held', flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def copies(own_home, monkeypatch):
    monkeypatch.setenv('ENGINE_MOUNT_CACHE_LIMIT', '100B')
    return own_home / 'copies'


def copy(key, size):
    """Return a context of the copy `key` of `size` bytes."""
    return cache.cached_copy(
        key, f'{key}.bin', size, lambda folder: (folder / f'{key}.bin').write_bytes(bytes(size))
    )


def use(copies, key, size):
    """Use a copy later than all others were used."""
    with copy(key, size):
        pass
    use.clock += 1
    os.utime(copies / f'{key}-{size}', (use.clock, use.clock))


use.clock = 1_700_000_000


def present(copies):
    return {path.name.removesuffix('.bin') for path in copies.rglob('*.bin')}


def test_as_many_as_needed_of_those_used_longest_ago_go(copies):
    for key, size in {'a': 30, 'b': 30, 'c': 30, 'd': 10}.items():
        use(copies, key, size)
    assert present(copies) == set('abcd')
    with copy('a', 30):
        pass  # takes the time of today
    use(copies, 'e', 30)
    assert present(copies) == set('acde')


def test_what_is_in_use_stays_here_and_in_another_process(copies):
    use(copies, 'a', 60)
    command = [sys.executable, '-c', HOLD]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == 'held\n'
        with pytest.raises(SourceError, match=r'may hold 0.0001 MB and has 6e-05 MB in use.*CACHE_LIMIT'):
            use(copies, 'b', 60)
        other.kill()
    with copy('a', 60):
        use(copies, 'b', 30)
        use(copies, 'c', 40)
        assert present(copies) == set('ac')
    use(copies, 'b', 60)
    assert present(copies) == {'b'}


def test_a_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', str(tmp_path / 'file' / 'copies'))
    with pytest.raises(SourceError, match=r'cannot be written: .*ENGINE_MOUNT_CACHE'), copy('a', 1):
        pass


def test_what_was_half_removed_is_not_taken_for_whole(copies, monkeypatch):
    use(copies, 'a', 60)
    with monkeypatch.context() as patch:
        patch.setattr(cache.shutil, 'rmtree', lambda place, **how: (place / 'a.bin').unlink(missing_ok=True))
        use(copies, 'b', 60)
    with copy('a', 60) as path:
        assert path.read_bytes() == bytes(60)


def test_what_fails_leaves_nothing_and_of_two_the_first_stays(copies):
    def fail(folder):
        (folder / 'a.bin').write_bytes(b'half')
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), cache.cached_copy('a', 'a.bin', 10, fail):
        pass
    assert not present(copies)

    def be_late(folder):
        (folder / 'a.bin').write_bytes(b'late')
        use(copies, 'a', 10)

    with cache.cached_copy('a', 'a.bin', 10, be_late) as path:
        assert path.read_bytes() == bytes(10)


def test_folder_and_limit_are_chosen_by_the_environment(monkeypatch, own_home):
    assert cache.cache_folder() == own_home / 'copies'
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', '')
    assert cache.cache_folder() == own_home / 'cache' / 'engine_mount' / 'recordings'
    monkeypatch.setenv('ENGINE_MOUNT_CACHE_LIMIT', 'much')
    with pytest.raises(ValueError, match='much'), copy('a', 1):
        pass
