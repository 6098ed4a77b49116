"""Ctrl-C is never lost, whoever is there to hear it."""

import os
import signal

import pytest

from mount_bringup.graph.shutdown import ending_signals, interrupt_and_remember


@pytest.fixture
def remembering():
    before = signal.signal(signal.SIGINT, interrupt_and_remember)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_signal_ends_in_order_while_somebody_can(remembering):
    ends = []
    with ending_signals(lambda: ends.append(True)):
        assert not ends
        os.kill(os.getpid(), signal.SIGINT)
        assert ends == [True]
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
    with ending_signals(lambda: ends.append(True)):
        assert ends == [True, True]  # that one was remembered
