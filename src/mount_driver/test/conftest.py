"""What the tests share:  a multicast group of their own, and the far end of the bus."""

import itertools
import os
import sys
from pathlib import Path

import pytest

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))

# A socket hears every group of its port that anyone on this machine has joined: ports of each process, too.
_ports = itertools.count(20_000 + 100 * (os.getpid() % 400))


@pytest.fixture
def multicast() -> tuple[str, int]:
    """Return a multicast group of this process and a port of this test."""
    process = os.getpid()
    return f'239.74.{process >> 8 & 0xFF}.{process & 0xFF}', next(_ports)
