"""Work on a fleet that is ended in the middle: what was done stands."""

import contextlib
from collections.abc import Iterator

from mount_bringup.graph.shutdown import Interrupted

_GOES_ON = 'the same command goes on where it stopped'


@contextlib.contextmanager
def resumable() -> Iterator[None]:
    """Say how the work goes on after Ctrl-C (`Interrupted`) and a lost cluster (`SchedulerLostError`)."""
    from engine_mount.fleet.runner import SchedulerLostError

    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted(f'what was done stands, and {_GOES_ON}') from None
    except SchedulerLostError as error:
        raise SchedulerLostError(f'{error}; with this cluster or another one {_GOES_ON}') from None
