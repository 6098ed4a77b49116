"""What the tests of the recorder share."""

from pathlib import Path

import pytest
from samples import write_drive


@pytest.fixture
def drive(tmp_path) -> Path:
    """Return a recording of 500 samples of three topics."""
    return write_drive(tmp_path / 'drive', 500)
