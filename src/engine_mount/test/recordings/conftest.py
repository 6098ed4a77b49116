"""What the tests share: small recordings, the genuine bags beside the repository."""

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest
from samples import write_drive


@pytest.fixture
def drive(tmp_path) -> Path:
    """Return a recording of 500 samples of three topics."""
    return write_drive(tmp_path / 'drive', 500)


@pytest.fixture
def place(tmp_path) -> Callable[[], Path]:
    """Return a new folder at each call."""
    numbers = itertools.count()
    return lambda: tmp_path / f'bag_{next(numbers)}'


@pytest.fixture
def genuine() -> Path:
    """Return the folder of bags that rosbag2 itself wrote."""
    folder = Path(__file__).parents[5] / 'shared' / 'data' / 'rosbag2'
    if not folder.is_dir():
        pytest.skip('no genuine bags: ../shared/data/rosbag2 beside the repository is absent')
    return folder
