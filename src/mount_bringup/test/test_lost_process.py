"""A real recorder that is killed or stands still, under a real supervisor: the graph goes on without it."""

import contextlib
import os
import signal

import engine_mount
from mount_bringup.graph.nodes import RECORDER, GraphSettings
from mount_bringup.graph.supervisor import Supervisor
from mount_recorder.folders import recordings_of

LIMIT = 60.0  # s: only a hang takes so long


@contextlib.contextmanager
def recording_graph(folder, domain, limit=3, **parameters):
    """A graph of nothing but a recorder: what is tested needs no machine that keeps 1 kHz."""
    values = {RECORDER.name: {'uri': str(folder / 'recording'), **parameters}}
    settings = GraphSettings(domain=domain, parameters=values, restart_limit=limit)
    graph = Supervisor((RECORDER,), settings, folder)
    try:
        graph.start(lambda parameters: 'scenario: none', lambda text: None)
        yield graph
    finally:
        assert graph.stop() == []


def pid_of(graph):
    [process] = graph.processes
    return process._process.pid


def lose(graph, number):
    """Send a signal to the recorder and wait until the graph works again."""
    before = len(graph.recovery.restarts)
    os.kill(pid_of(graph), number)
    graph.wait_until(lambda: len(graph.recovery.restarts) > before, LIMIT, 'recovery')
    graph.wait_until(lambda: graph.figures(RECORDER).get('state') == 'active', LIMIT, 'an active recorder')


def test_a_killed_recorder_begins_a_new_recording_and_the_old_one_stays_readable(tmp_path, domain):
    told = []
    with recording_graph(tmp_path, domain) as graph:
        graph.recovery.report = told.append
        graph.wait_until(lambda: int(graph.figures(RECORDER).get('received', 0)) > 2, LIMIT, 'messages')
        lose(graph, signal.SIGKILL)
        [restart] = graph.recovery.restarts
    assert restart.nodes == (RECORDER,)
    assert 'ended with code -9' in told[0]
    assert 'started again with a new recording' in restart.sentence
    first, second = recordings_of(tmp_path / 'recording')
    assert second.name == 'recording_restarted_2'
    assert len(engine_mount.open(first)['session']) == 1
    whole = engine_mount.open(second)
    assert whole.warnings == []
    assert len(whole['session']) == 1  # latched by the supervisor, so the new recording tells what it is


def test_a_recorder_that_stands_still_is_treated_as_failed_after_the_limit(tmp_path, domain):
    with recording_graph(tmp_path, domain) as graph:
        lose(graph, signal.SIGSTOP)
        expected = 'mount_recorder: no diagnostics for 4 s (limit 4 s): treated as failed; check its log'
        assert expected in graph.recovery.restarts[0].sentence
