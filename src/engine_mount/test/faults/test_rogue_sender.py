"""The process that sends what only the graph may send, beside no graph."""

import subprocess
import sys

import pytest
from ros_testing import free_domain


@pytest.mark.slow
def test_a_rogue_sender_ends_with_its_input_though_no_graph_listens_any_more():
    """A graph that detects it as it appears has ended before it is matched."""
    with free_domain() as domain:
        ended = subprocess.run(
            [sys.executable, '-m', 'engine_mount.faults.rogue_sender', 'air_gap', str(domain), 'nowhere'],
            input='go\n',
            capture_output=True,
            text=True,
            timeout=60.0,
            check=False,
        )
    assert (ended.stdout, ended.returncode) == ('ready\n', 0), ended.stderr
