"""What `mount_driver` says of itself on `/diagnostics`: whether it keeps the coil at 0 A, and why.

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

    def __init__(self, namespace: str):
        self._name = f'{namespace.strip("/")}/mount_driver'.lstrip('/')
        self._refusal = ''
        self._heard = 0.0  # s, steady clock

    def take(self, node: str, sentence: str, figures: Mapping[str, str]) -> None:
        """Take the verdict of any node, by its name with namespace."""
        if node == self._name:
            refuses = any(figures.get(name) == 'True' for name in _REFUSALS)
            self._refusal = f'mount_driver keeps the coil at 0 A: {sentence}' if refuses else ''
            self._heard = time.monotonic()

    @property
    def refusal(self) -> str:
        """Why the driver keeps the coil at 0 A now, empty where it has not said so within 2 s."""
        return self._refusal if time.monotonic() - self._heard < _LONGEST_AGE else ''

    def settled(self, refusing: bool, patience: float, ending: threading.Event) -> str:
        """Return `refusal` as soon as there is one or none as `refusing` says, or after `patience` s."""
        end = time.monotonic() + patience
        while bool(self.refusal) is not refusing and time.monotonic() < end:
            if ending.wait(_LOOK_PERIOD):
                break
        return self.refusal
