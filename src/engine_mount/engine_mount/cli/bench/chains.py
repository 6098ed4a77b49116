"""The graph in real time beside a chain of empty nodes: short runs in turn, medians of several rounds."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import monotonic
from typing import NamedTuple

import psutil

from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report
from engine_mount.cli.bench.relay import EVENTS, SPIN
from engine_mount.settings.options import with_sample_rate
from mount_bringup.graph.domain import can_port, domain_lock
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    SIMULATED,
    GraphError,
    GraphSettings,
    Grouping,
)
from mount_bringup.graph.shutdown import ending_signals
from mount_bringup.graph.supervisor import Supervisor
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.session import session_text
from mount_ros.environment import prepare_environment

_SETTLING = 2.0  # s, chosen: the simulator reports its figures every second
_SLACK = 60.0  # s, chosen: a machine that is this late measures nothing
_RELAY_PORT = 118  # chosen: behind that of the graph; only a namespace with this very place has it too
_TIMEOUT = 10.0  # s, chosen: for a process that was asked to end
_LARGEST_GROWTH = 1e6 / 1800.0  # B/s, chosen: 1 MB in 30 minutes
_ROWS = (
    ('latency', 'setpoint latency', 's'),
    ('latency_p99', 'setpoint latency, p99', 's'),
    ('cpu', 'driver, init, control', 'cores'),
    ('start', 'start to first setpoint', 's'),
    ('missing', 'unanswered samples', '1'),
)
"""Field of `ChainRun`, what it is, unit."""


class ChainRun(NamedTuple):
    """Figures of one run, SI."""

    latency: float
    """Median from a sample's frame to the frame that answers it."""
    latency_p99: float
    """99 % of them are below."""
    cpu: float
    """Share of one core that the processes between the frames used."""
    start: float
    """From the order to start to the first answer in normal service."""
    growth: float
    """Memory that the process that grew most won, B."""
    missing: float
    """Share of the samples that were not answered."""
    unrecorded: float = 0.0
    """Messages that came to the recorder and do not stand in its file."""


def measure(order: BenchOrder, report: Report) -> Figures:
    """Return latency, processor time, start and growth of memory of the graph, separate and composed."""
    runs: dict[str, list[ChainRun]] = {name: [] for name in ('graph', 'spin', 'events', 'composed')}
    for number in range(1, order.rounds + 1):
        report(f'graph and empty nodes in real time, round {number} of {order.rounds}')
        runs['graph'].append(_run_graph(order, Grouping.APART))
        runs['spin'].append(run_relay(order, SPIN))
        runs['events'].append(run_relay(order, EVENTS))
        runs['composed'].append(_run_graph(order, Grouping.COMPOSED))
    figures: dict[str, Comparison] = {}
    for ending, graph in ('', 'graph'), ('_composed', 'composed'):
        for field, what, unit in _ROWS:
            for suffix, chain in ('', 'spin'), ('_events', 'events'):
                if chain == 'spin' or field == 'latency':
                    values = _median(runs[graph], field), f'empty nodes, {chain}', _median(runs[chain], field)
                    words = what + ending.replace('_', ', ')
                    figures[field + ending + suffix] = Comparison(words, *values, unit)
    growth, allowed = _median(runs['graph'], 'growth'), order.seconds * _LARGEST_GROWTH
    lost = max(run.unrecorded for run in runs['graph'] + runs['composed'])
    return figures | {
        'memory': Comparison('memory growth of a node', growth, '1 MB in 30 minutes', allowed, 'B'),
        'unrecorded': Comparison('messages lost by the recorder', lost, 'none', 0.0, '1'),
    }


def run_relay(order: BenchOrder, executor: str) -> ChainRun:
    """Run the chain of empty nodes, in two processes between the frames."""
    begin, rate = monotonic(), order.sample_rate or SAMPLE_RATE
    with _relay(order.domain, executor) as (port, processes):
        options = '--seconds', str(order.seconds), '--rate', str(rate)
        command = _command('peer', port, *options)
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as peer:
            first = float(_line(peer))
            with _watched(processes) as found:
                figures = json.loads(_line(peer))
    missing = 1.0 - figures['answered'] / figures['samples']
    latencies = figures['latency_median_s'], figures['latency_p99_s']
    return ChainRun(*latencies, found['cpu'], first - begin, found['growth'], missing)


def _run_graph(order: BenchOrder, grouping: Grouping) -> ChainRun:
    """Drive the bench scenario and record it."""
    port = {'port': can_port(order.domain, '')}
    drive = {'scenario': 'bench', 'timeline.duration': 3600.0, **port}
    prepare_environment()
    with TemporaryDirectory() as folder, domain_lock(order.domain, ''):
        recording = {'uri': f'{folder}/recording'}
        chosen = {DRIVER.name: port, SIM.name: drive, RECORDER.name: recording}
        parameters = with_sample_rate(chosen, order.sample_rate or SAMPLE_RATE)
        settings = GraphSettings(
            domain=order.domain, parameters=parameters, grouping=grouping, priority=order.priority
        )
        supervisor = Supervisor(SIMULATED, settings, Path(folder))
        begin = monotonic()
        with ending_signals(supervisor.interrupt), contextlib.ExitStack() as ending:
            ending.callback(supervisor.stop)
            supervisor.start(lambda told: session_text({'parameters': told}), lambda words: None)
            start = monotonic() - begin
            _serve(supervisor, _SETTLING)
            before = {name: int(supervisor.figures(DRIVER).get(name, 0)) for name in ('samples', 'setpoints')}
            with _watched(_node_processes()) as found:
                _serve(supervisor, order.seconds)
            after, bus = supervisor.figures(DRIVER), supervisor.figures(SIM)
            samples, answered = (int(after[name]) - before[name] for name in ('samples', 'setpoints'))
            lost = int(supervisor.figures(RECORDER)['lost'])
    latencies = float(bus['latency_median_s']), float(bus['latency_p99_s'])
    missing = 1.0 - answered / max(1, samples)
    return ChainRun(*latencies, found['cpu'], start, found['growth'], missing, lost)


def _node_processes() -> list[psutil.Process]:
    """Return the processes of driver, initialisation and control that this one has started."""
    modules = [f'from {node.name}.node' for node in (DRIVER, INIT, CONTROL)]
    children = psutil.Process().children()
    return [child for child in children if any(name in ' '.join(child.cmdline()) for name in modules)]


@contextlib.contextmanager
def _relay(domain: int, executor: str) -> Iterator[tuple[int, list[psutil.Process]]]:
    """Keep the chain of empty nodes running, and give the port of its bus and its processes."""
    prepare_environment()
    port = can_port(domain, '') + _RELAY_PORT
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    commands = [_command(part, port, '--executor', executor) for part in ('ends', 'middle')]
    processes = [psutil.Popen(command, env=environment) for command in commands]
    try:
        yield port, processes
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        _, left = psutil.wait_procs(processes, _TIMEOUT)
        for process in left:
            process.kill()


def _command(part: str, port: int, *options: str) -> list[str]:
    return [sys.executable, '-P', '-m', 'engine_mount.cli.bench.relay', part, '--port', str(port), *options]


def _line(peer: subprocess.Popen[str]) -> str:
    """Return the next line that the peer prints; one that prints none has ended with an error of its own."""
    assert peer.stdout is not None
    line = peer.stdout.readline()
    if not line:
        raise GraphError(f'the peer of the empty nodes ended with code {peer.wait()}; is the machine busy?')
    return line


@contextlib.contextmanager
def _watched(processes: Sequence[psutil.Process]) -> Iterator[dict[str, float]]:
    """Fill in what the processes used meanwhile: `cpu` in cores, `growth` of the one that grew most in B."""
    used, held, begin = _processor_time(processes), [p.memory_info().rss for p in processes], monotonic()
    found: dict[str, float] = {}
    yield found
    seconds = monotonic() - begin
    growth = max(p.memory_info().rss - before for p, before in zip(processes, held, strict=True))
    found.update(cpu=(_processor_time(processes) - used) / seconds, growth=float(growth))


def _processor_time(processes: Sequence[psutil.Process]) -> float:
    """Return the processor time of all threads of the processes so far, s."""
    return sum(times.user + times.system for times in (process.cpu_times() for process in processes))


def _serve(supervisor: Supervisor, seconds: float) -> None:
    end = monotonic() + seconds
    supervisor.wait_until(lambda: monotonic() > end, _SLACK + seconds, 'the end of the measurement')


def _median(runs: Sequence[ChainRun], field: str) -> float:
    return median(getattr(run, field) for run in runs)
