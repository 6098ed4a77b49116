"""Short runs in real time: the graph, and the chain of empty nodes, of which the same is measured."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from engine_mount.cli.bench.processes import children, memory, processor_time
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

_SETTLING = 2.0  # s, chosen: the simulator tells its figures every second
_SLACK = 60.0  # s, chosen: a machine that is this late measures nothing
_RELAY_PORT = 118  # chosen: behind that of the graph; only a namespace with this very place has it too
_ENDS, _MIDDLE = 'ends', 'middle'
_PATIENCE = 10.0  # s, chosen: for a process that was asked to end


class ChainRun(NamedTuple):
    """What was measured of one run, SI."""

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


class Place(NamedTuple):
    """Where the runs take place: ROS domain, and the real-time priority of the graph (0: none)."""

    domain: int
    priority: int = 0


def run_graph(
    place: Place, seconds: float, sample_rate: float = SAMPLE_RATE, *, composed: bool = False
) -> ChainRun:
    """Drive the bench scenario for `seconds` and record it, every node in a process or `composed`."""
    port = {'port': can_port(place.domain, '')}
    drive = {'scenario': 'bench', 'timeline.duration': 3600.0, **port}
    prepare_environment()
    with tempfile.TemporaryDirectory() as folder, domain_lock(place.domain, ''):
        recording = {'uri': f'{folder}/recording'}
        chosen = {DRIVER.name: port, SIM.name: drive, RECORDER.name: recording}
        parameters = with_sample_rate(chosen, sample_rate)
        settings = GraphSettings(
            domain=place.domain,
            parameters=parameters,
            grouping=Grouping.COMPOSED if composed else Grouping.APART,
            priority=place.priority,
        )
        supervisor = Supervisor(SIMULATED, settings, Path(folder))
        begin = time.monotonic()
        with ending_signals(supervisor.interrupt), _stopped(supervisor):
            supervisor.start(lambda told: session_text({'parameters': told}), lambda words: None)
            start = time.monotonic() - begin
            _serve(supervisor, _SETTLING)
            before = {name: int(supervisor.figures(DRIVER).get(name, 0)) for name in ('samples', 'setpoints')}
            modules = [f'from {node.name}.node' for node in (DRIVER, INIT, CONTROL)]
            with _watched(children(modules)) as found:
                _serve(supervisor, seconds)
            after, bus = supervisor.figures(DRIVER), supervisor.figures(SIM)
            samples, answered = (int(after[name]) - before[name] for name in ('samples', 'setpoints'))
            lost = int(supervisor.figures(RECORDER)['lost'])
    return ChainRun(
        float(bus['latency_median_s']),
        float(bus['latency_p99_s']),
        found['cpu'],
        start,
        found['growth'],
        1.0 - answered / max(1, samples),
        lost,
    )


@contextlib.contextmanager
def _stopped(supervisor: Supervisor) -> Iterator[None]:
    """Stop the graph at the end, whatever it is."""
    try:
        yield
    finally:
        supervisor.stop()


def run_relay(
    place: Place, seconds: float, sample_rate: float = SAMPLE_RATE, executor: str = SPIN
) -> ChainRun:
    """Run the chain of empty nodes for as long, in two processes between the frames."""
    begin = time.monotonic()
    with _relay(place, [[_ENDS], [_MIDDLE]], executor) as (port, processes):
        peer = _peer(port, seconds, sample_rate)
        first = float(_line(peer))
        with _watched(processes) as found:
            told = json.loads(_line(peer))
        peer.wait()
    missing = 1.0 - told['answered'] / told['samples']
    latencies = told['latency_median_s'], told['latency_p99_s']
    return ChainRun(*latencies, found['cpu'], first - begin, found['growth'], missing)


def relay_in_turn(place: Place, seconds: float) -> float:
    """Return the samples per second of the composed chain whose peer waits for each answer."""
    with _relay(place, [[_ENDS, _MIDDLE]], EVENTS) as (port, _):
        peer = _peer(port, seconds, 0.0)
        _line(peer)
        told = json.loads(_line(peer))
        peer.wait()
    return float(told['answered']) / seconds


@contextlib.contextmanager
def _relay(place: Place, groups: Sequence[Sequence[str]], executor: str) -> Iterator[tuple[int, list[int]]]:
    """Keep a process for each group of parts running, and give the port of their bus and their ids."""
    prepare_environment()
    port = can_port(place.domain, '') + _RELAY_PORT
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(place.domain)}
    processes = [
        subprocess.Popen(_command(group, port, '--executor', executor), env=environment) for group in groups
    ]
    try:
        yield port, [process.pid for process in processes]
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        for process in processes:
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _peer(port: int, seconds: float, rate: float) -> subprocess.Popen[str]:
    command = _command(['peer'], port, '--seconds', str(seconds), '--rate', str(rate))
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _line(peer: subprocess.Popen[str]) -> str:
    """Return the next line that the peer prints; one that prints none has ended with an error of its own."""
    assert peer.stdout is not None
    line = peer.stdout.readline()
    if not line:
        raise GraphError(f'the peer of the empty nodes ended with code {peer.wait()}; is the machine busy?')
    return line


def _command(parts: Sequence[str], port: int, *options: str) -> list[str]:
    return [sys.executable, '-P', '-m', 'engine_mount.cli.bench.relay', *parts, '--port', str(port), *options]


@contextlib.contextmanager
def _watched(watched: Sequence[int]) -> Iterator[dict[str, float]]:
    """Fill in what the processes used meanwhile: `cpu` in cores, `growth` of the one that grew most in B."""
    used, held, begin = _total(watched), [memory(number) for number in watched], time.monotonic()
    found: dict[str, float] = {}
    yield found
    seconds = time.monotonic() - begin
    grown = [memory(number) - before for number, before in zip(watched, held, strict=True)]
    found.update(cpu=(_total(watched) - used) / seconds, growth=float(max(grown)))


def _total(processes: Sequence[int]) -> float:
    return sum(processor_time(number) for number in processes)


def _serve(supervisor: Supervisor, seconds: float) -> None:
    end = time.monotonic() + seconds
    supervisor.wait_until(lambda: time.monotonic() > end, _SLACK + seconds, 'the end of the measurement')
