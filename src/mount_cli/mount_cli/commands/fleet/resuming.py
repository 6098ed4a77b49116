"""Ctrl-C amid the work on a fleet: what was done stands."""

import contextlib
from collections.abc import Iterator

from mount_bringup.graph.errors import Interrupted


@contextlib.contextmanager
def resumable() -> Iterator[None]:
    """Raise `Interrupted` for Ctrl-C, with the sentence that says how the work goes on."""
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted('what was done stands, and the same command goes on where it stopped') from None
