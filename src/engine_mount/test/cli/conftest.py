"""What the tests of this package share: small pictures."""

import pytest

from engine_mount.experiments.harness import drawing


@pytest.fixture(autouse=True, scope='session')
def small_pictures():
    """Draw the experiments' pictures small and without a search for their layout, a third of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, '_DPI', 20)
        patch.setattr(drawing, '_LAYOUT', None)
        yield
