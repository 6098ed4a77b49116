"""With NUMBA_DISABLE_JIT=1 the laws are plain Python, for a debugger, and answer the same to the bit."""

import os
import subprocess
import sys

import pytest
from reference_differences import differences_from_reference
from references import REFERENCES

pytestmark = pytest.mark.slow

LIMIT = 600.0  # s: only a hang takes so long
REPLAYS = """
import sys, types
from pathlib import Path
from mount_models.arithmetic.sums import interpolated
from engine_mount.drives.replay import replay

assert isinstance(interpolated, types.FunctionType), 'compiled'
folder, *references = map(Path, sys.argv[1:])
for reference in references:
    replay(reference, out=folder / reference.name)
"""


def test_the_accepted_setpoints_are_met_to_the_bit_without_the_compiler(tmp_path):
    process = subprocess.run(
        [sys.executable, '-c', REPLAYS, tmp_path, *REFERENCES],
        env={**os.environ, 'NUMBA_DISABLE_JIT': '1'},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    for reference in REFERENCES:
        assert not differences_from_reference(reference, tmp_path / reference.name / 'recording')
