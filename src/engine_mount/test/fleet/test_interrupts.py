"""An interrupt of a fleet run is never lost."""

import os
import signal
import sys

import pytest

from engine_mount.fleet.interrupts import remembered_interrupts


def test_an_interrupt_that_came_in_a_destructor_is_raised_by_who_waits(monkeypatch):
    class Interrupted:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGINT)

    printed = []
    monkeypatch.setattr(sys, 'unraisablehook', printed.append)
    before = signal.getsignal(signal.SIGINT)
    with remembered_interrupts() as raise_lost:
        raise_lost()
        Interrupted()
        assert not printed  # Python prints and drops what a destructor raises
        with pytest.raises(KeyboardInterrupt):
            raise_lost()
    assert signal.getsignal(signal.SIGINT) is before
