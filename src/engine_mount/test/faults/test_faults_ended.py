"""A run of the fault matrix that is told to end leaves no graph behind."""

import os
import signal
import subprocess
from pathlib import Path

import pytest
from ros_testing import free_domain

from engine_mount.faults import session
from engine_mount.faults.case import MATRIX
from engine_mount.faults.graph import Place, tied


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_graph_that_runs_is_ended_whatever_signal_comes(monkeypatch, number):
    ended = []

    class Session:
        def __init__(self, *_):
            pass

        def outcome(self, _):
            os.kill(os.getpid(), number)
            pytest.fail('the run goes on')

        def end_graph(self):
            os.kill(os.getpid(), number)  # whoever is in a hurry
            ended.append(number)

    monkeypatch.setattr(session, '_Session', Session)
    before = signal.getsignal(number)
    cases = [MATRIX['can_silent']]
    with free_domain() as domain:
        place = Place([], domain, Path(), 0)
        with pytest.raises(KeyboardInterrupt):
            session.run_faults(cases, place, lambda *_: None, lambda *_: None)
    assert ended == [number]
    assert signal.getsignal(number) is before


def test_a_program_of_others_is_not_run_for_a_starter_that_has_ended(monkeypatch):
    assert subprocess.run(tied(['echo', 'run']), stdout=subprocess.PIPE, check=True).stdout == b'run\n'
    with subprocess.Popen(['true']) as other:
        monkeypatch.setattr(os, 'getpid', lambda: other.pid)
        ended = subprocess.run(tied(['echo', 'run']), stdout=subprocess.PIPE, check=False)
    assert (ended.returncode, ended.stdout) == (1, b'')
