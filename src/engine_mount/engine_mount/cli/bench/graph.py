"""The graph in real time beside a chain of empty nodes: short runs in turn, medians of several rounds."""

import contextlib
import os
import signal
import sys
from functools import partial
from pathlib import Path
from statistics import median, quantiles
from tempfile import TemporaryDirectory
from time import monotonic
from typing import NamedTuple

import psutil

from engine_mount.cli.bench import BenchOrder, Comparison, Figures, Report, relay
from engine_mount.settings.options import with_sample_rate
from mount_bringup.graph.domain import can_port, domain_lock
from mount_bringup.graph.nodes import (
    DRIVER,
    RECORDER,
    SIM,
    SIMULATED,
    GraphSettings,
    Grouping,
)
from mount_bringup.graph.shutdown import ending_signals
from mount_bringup.graph.supervisor import Supervisor
from mount_recorder.session import session_text
from mount_ros.environment import prepare_environment

_SETTLING = 2.0  # s, chosen: the simulator reports its figures every second
_SLACK = 60.0  # s, chosen: a machine that is this late measures nothing
_RELAY_PORT = 118  # chosen: behind that of the graph; only a namespace with this very place has it too
_TIMEOUT = 10.0  # s, chosen: for a process that was asked to end
_ROWS = (
    ('latency', 'setpoint latency', 's'),
    ('latency_p99', 'setpoint latency, p99', 's'),
    ('missing', 'unanswered samples', '1'),
)
"""Field of `ChainRun`, what it is, unit."""


class ChainRun(NamedTuple):
    """Figures of one run, SI."""

    latency: float
    """Median from a sample's frame to the frame that answers it."""
    latency_p99: float
    """99 % of them are below."""
    missing: float
    """Share of the samples that were not answered."""


def graph(order: BenchOrder, report: Report) -> Figures:
    """Return the latency of the graph, separate and composed, beside the empty nodes."""
    kinds = {
        'graph': partial(_run_graph, order, Grouping.APART),
        'relay': partial(run_relay, order),
        'composed': partial(_run_graph, order, Grouping.COMPOSED),
    }
    runs: dict[str, list[ChainRun]] = {name: [] for name in kinds}
    for number in range(1, order.rounds + 1):
        report(f'graph and empty nodes in real time, round {number} of {order.rounds}')
        for name, run in kinds.items():
            runs[name].append(run())
    found = {name: ChainRun(*map(median, zip(*own, strict=True))) for name, own in runs.items()}
    return {
        field + ending.replace(', ', '_'): Comparison(
            what + ending, getattr(found[graph], field), 'empty nodes', getattr(found['relay'], field), unit
        )
        for ending, graph in (('', 'graph'), (', composed', 'composed'))
        for field, what, unit in _ROWS
    }


def run_relay(order: BenchOrder) -> ChainRun:
    """Run the chain of empty nodes, in two processes between the frames."""
    prepare_environment()
    port = can_port(order.domain, '') + _RELAY_PORT
    program = [sys.executable, '-P', '-m', relay.__name__]
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(order.domain)}
    processes = [psutil.Popen([*program, part, str(port)], env=environment) for part in ('ends', 'middle')]
    try:
        samples, late = relay.measure(port, order.seconds, order.sample_rate)
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        _, left = psutil.wait_procs(processes, _TIMEOUT)
        for process in left:
            process.kill()
    percent = quantiles(late, n=100)
    return ChainRun(percent[49], percent[98], 1.0 - len(late) / samples)


def _run_graph(order: BenchOrder, grouping: Grouping) -> ChainRun:
    """Drive the bench scenario and record it."""
    port = {'port': can_port(order.domain, '')}
    drive = {'scenario': 'bench', 'timeline.duration': 3600.0, **port}
    prepare_environment()
    with TemporaryDirectory() as folder, domain_lock(order.domain, ''):
        recording = {'uri': f'{folder}/recording'}
        chosen = {DRIVER.name: port, SIM.name: drive, RECORDER.name: recording}
        settings = GraphSettings(
            domain=order.domain,
            parameters=with_sample_rate(chosen, order.sample_rate),
            grouping=grouping,
            priority=order.priority,
        )
        supervisor = Supervisor(SIMULATED, settings, Path(folder))
        with ending_signals(supervisor.interrupt), contextlib.ExitStack() as ending:
            ending.callback(supervisor.stop)
            supervisor.start(lambda told: session_text({'parameters': told}), lambda words: None)
            _serve(supervisor, _SETTLING)
            before = {name: int(supervisor.figures(DRIVER).get(name, 0)) for name in ('samples', 'setpoints')}
            _serve(supervisor, order.seconds)
            after, bus = supervisor.figures(DRIVER), supervisor.figures(SIM)
    samples, answered = (int(after[name]) - before[name] for name in ('samples', 'setpoints'))
    latencies = float(bus['latency_median_s']), float(bus['latency_p99_s'])
    return ChainRun(*latencies, 1.0 - answered / max(1, samples))


def _serve(supervisor: Supervisor, seconds: float) -> None:
    end = monotonic() + seconds
    supervisor.wait_until(lambda: monotonic() > end, _SLACK + seconds, 'the end of the measurement')
