"""Whether electronics that compute the law themselves come to the same setpoints, to the bit.

It only observes: no setpoint depends on it.
"""

from mount_control.control_loop import SampleCounts
from mount_models.sampling import SETPOINT_TIMEOUT

LATEST = round(1e9 * SETPOINT_TIMEOUT)
"""ns: a setpoint that comes later behind that of mount_control counts as missing."""


class Shadow:
    """Compares the setpoints of electronics with those of mount_control; lives as long as an activation."""

    def __init__(self, counts: SampleCounts):
        """`counts` of the samples since the activation."""
        self._counts = counts
        self.compared = self.different = self.missing = 0
        self.first_difference = ''
        self._waiting: dict[bool, dict[int, float]] = {False: {}, True: {}}  # by `own`: A by stamp

    def take(self, stamp: int, current: float, *, own: bool) -> None:
        """Take a setpoint (A) for the sample of `stamp` (ns): an `own` one, or that of the electronics."""
        waiting, other = self._waiting[own], self._waiting[not own].pop(stamp, None)
        if other is not None:
            self.compared += 1
            if other.hex() != current.hex():  # to the bit, unlike ==
                self.different += 1
                pair = (other, current) if own else (current, other)
                lapses = self._counts.bridged + self._counts.implausible
                self.first_difference = self.first_difference or _difference(stamp, *pair, lapses)
            return
        waiting[stamp] = current
        while stamp - (oldest := next(iter(waiting))) > LATEST:
            del waiting[oldest]
            self.missing += own

    @property
    def figures(self) -> dict[str, int]:
        """What was counted since the activation, by the names of the figures in the diagnostics."""
        return {f'shadow_{name}': getattr(self, name) for name in ('compared', 'different', 'missing')}


def _difference(stamp: int, electronics: float, own: float, lapses: int) -> str:
    remedy = (
        f'mount_control has bridged or refused {lapses} samples: activate mount_init and mount_control again'
        if lapses
        else 'export the law with the parameters of mount_control (engine-mount export c) and load it again'
    )
    return (
        f'setpoint of the electronics ({electronics!r} A) differs from that of mount_control ({own!r} A) for '
        f'the sample of {1e-9 * stamp:.3f} s (limit: no bit), the first that does; {remedy}'
    )
