"""A run of the fault matrix that is told to end leaves no graph behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from ros_testing import free_domain

from engine_mount.faults import session
from engine_mount.faults.case import MATRIX
from engine_mount.faults.graph import TIED, Place, runs


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


def test_a_graph_ends_with_the_process_that_started_it():
    start = f'started = subprocess.Popen({[*TIED, "sleep", "60"]})'
    code = f'import subprocess; {start}; print(started.pid, flush=True); started.wait()'
    end = time.monotonic() + 30.0
    with subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE) as starter:
        graph = psutil.Process(int(starter.stdout.readline()))
        while graph.name() != 'sleep':
            assert time.monotonic() < end
        starter.kill()
        while runs(graph):
            assert time.monotonic() < end
