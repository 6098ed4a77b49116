"""What the tests of the recorder share."""

import sys
from pathlib import Path

import pytest

# The tests are imported one by one (importmode importlib); what they share is found by this path.
sys.path.insert(0, str(Path(__file__).parent))

from samples import write_drive


@pytest.fixture
def drive(tmp_path) -> Path:
    """Return a recording of 500 samples of three topics."""
    return write_drive(tmp_path / 'drive', 500)
