"""What `mount_driver` says of itself on `/diagnostics`: why the coil gets too little current, or too late.

A ramp that gets no current looks like a broken cable; the driver knows the reason.
"""

import threading
import time
from collections.abc import Mapping

_LONGEST_AGE = 2.0  # s, chosen: every node tells its verdict once a second
_REFUSALS = ('switched_off', 'held')  # figures of the driver
_LOOK_PERIOD = 0.02  # s, chosen


class DriverReport:
    """The newest verdict of the driver of one mount; one thread takes it while another asks."""

    def __init__(self, namespace: str, peak_current: float = 0.0):
        """`peak_current`: what the ramp needs, A."""
        self._peak = peak_current
        self._name = f'{namespace.strip("/")}/mount_driver'.lstrip('/')
        self._refusal = ''
        self.late_setpoints: int | None = None
        """How many setpoints came too late since its activation; None where it has not said so."""
        self._heard = 0.0  # s, steady clock

    def take(self, node: str, sentence: str, figures: Mapping[str, str]) -> None:
        """Take the verdict of any node, by its name with namespace."""
        if node == self._name:
            refuses = any(figures.get(name) == 'True' for name in _REFUSALS)
            allowed = float(figures.get('current_limit', self._peak))
            self._refusal = ''
            if refuses:
                self._refusal = f'mount_driver keeps the coil at 0 A: {sentence}'
            elif allowed < self._peak:
                needed = f'the ramp needs {self._peak:.3f} A'
                self._refusal = f'mount_driver lets the coil carry {allowed:.3f} A, {needed}: {sentence}'
            self.late_setpoints = int(figures['late_setpoints']) if 'late_setpoints' in figures else None
            self._heard = time.monotonic()

    @property
    def refusal(self) -> str:
        """Why the driver lets no ramp through now, empty where it has not said so within 2 s."""
        return self._refusal if time.monotonic() - self._heard < _LONGEST_AGE else ''

    def hear(self, patience: float, ending: threading.Event) -> None:
        """Return when another verdict has come, or after `patience` s."""
        begin = time.monotonic()
        while self._heard <= begin and time.monotonic() < begin + patience:
            if ending.wait(_LOOK_PERIOD):
                break

    def settled(self, refusing: bool, patience: float, ending: threading.Event) -> str:
        """Return `refusal` as soon as there is one or none as `refusing` says, or after `patience` s."""
        end = time.monotonic() + patience
        while bool(self.refusal) is not refusing and time.monotonic() < end:
            if ending.wait(_LOOK_PERIOD):
                break
        return self.refusal
