"""The memory of a process in real time stays in place, where the system permits it."""

import os
import subprocess
import sys

import pytest

TELL = """
import os, resource
from pathlib import Path
from mount_ros.nodes import scheduling

def locked():
    return int(Path('/proc/self/status').read_text().split('VmLck:')[1].split()[0])

{before}
print(scheduling.lock_memory(), locked() > 1000, end=' ')
new = bytearray(50_000_000)
print(locked() > 50_000)
"""
LIMITED = """
resource.setrlimit(resource.RLIMIT_MEMLOCK, (8 << 20, 8 << 20))
os.geteuid = lambda: 1
"""


def told(before=''):
    command = [sys.executable, '-c', TELL.format(before=before)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.skipif(os.geteuid() != 0, reason='only who may lock memory without a limit')
def test_what_is_there_and_what_comes_is_locked():
    assert told() == ['True', 'True', 'True']


def test_a_part_of_the_memory_is_never_locked():
    """At the limit the process would get no new memory."""
    assert told(LIMITED) == ['False', 'False', 'False']
