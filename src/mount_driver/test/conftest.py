"""What the tests share: a domain and a multicast group of their own, and the far end of the bus."""

import itertools
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mount_ros.testing import free_domain

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))

_ports = itertools.count(20_000)


@pytest.fixture
def multicast() -> tuple[str, int]:
    """Return a multicast group of this process and a port of this test."""
    process = os.getpid()
    return f'239.74.{process >> 8 & 0xFF}.{process & 0xFF}', next(_ports)


@pytest.fixture
def domain() -> Iterator[int]:
    """Return a domain id that no other test of this machine uses at the same time."""
    with free_domain() as number:
        yield number
