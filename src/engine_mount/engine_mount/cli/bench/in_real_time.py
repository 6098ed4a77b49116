"""The figures of the graph beside the chain of empty nodes: runs in turn, medians of several rounds."""

import statistics
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from engine_mount.cli.bench.chain_runs import ChainRun, Place, relay_in_turn, run_graph, run_relay
from engine_mount.cli.bench.comparison import Comparison
from engine_mount.cli.bench.relay import EVENTS
from mount_bringup.graph.domain import domain_lock
from mount_bringup.graph.nodes import RECORDER, SIM, SIMULATED, GraphSettings, Grouping
from mount_bringup.graph.supervisor import Supervisor
from mount_recorder.session import session_text
from mount_ros.environment import prepare_environment
from mount_sim.diagnosis import FINISHED

_APART, _COMPOSED = 'empty nodes, rclpy.spin', 'empty nodes, one process'
_EVENTS = 'empty nodes, EventsExecutor'
_FAST = 2000.0  # Hz
_LARGEST_GROWTH = 1e6 / 1800.0  # B/s, chosen: 1 MB in 30 minutes
_LOCKSTEP_DRIVE = 5.0  # s of excitation
_LOCKSTEP_LIMIT = 600.0  # s, chosen

Say = Callable[[str], None]


def graph_figures(place: Place, seconds: float, rounds: int, say: Say) -> dict[str, Comparison]:
    """Return latency, processor time, start and growth of memory, by name; each run lasts `seconds`."""
    graph: list[ChainRun] = []
    graph_composed: list[ChainRun] = []
    apart: list[ChainRun] = []
    apart_events: list[ChainRun] = []
    for number in range(1, rounds + 1):
        say(f'graph and empty nodes in real time, round {number} of {rounds}')
        graph.append(run_graph(place, seconds))
        apart.append(run_relay(place, seconds))
        apart_events.append(run_relay(place, seconds, executor=EVENTS))
        graph_composed.append(run_graph(place, seconds, composed=True))
    allowed = seconds * _LARGEST_GROWTH
    unrecorded = max(run.unrecorded for run in (*graph, *graph_composed))
    return {
        'latency': _compared('setpoint latency', graph, _APART, apart, 'latency'),
        'latency_composed': _compared('setpoint latency, composed', graph_composed, _APART, apart, 'latency'),
        'latency_p99': _compared('setpoint latency, p99', graph, _APART, apart, 'latency_p99'),
        'latency_p99_composed': _compared(
            'setpoint latency, p99, composed', graph_composed, _APART, apart, 'latency_p99'
        ),
        'latency_events': _compared('setpoint latency', graph, _EVENTS, apart_events, 'latency'),
        'latency_composed_events': _compared(
            'setpoint latency, composed', graph_composed, _EVENTS, apart_events, 'latency'
        ),
        'cpu': _compared('driver, init, control', graph, _APART, apart, 'cpu', 'cores'),
        'cpu_composed': _compared(
            'driver, init, control, composed', graph_composed, _APART, apart, 'cpu', 'cores'
        ),
        'start': _compared('start to first setpoint', graph, _APART, apart, 'start'),
        'memory': Comparison(
            'memory growth of a node', _median(graph, 'growth'), '1 MB in 30 minutes', allowed, 'B'
        ),
        'unanswered': _compared('unanswered samples', graph, _APART, apart, 'missing', '1'),
        'unrecorded': Comparison('messages lost by the recorder', unrecorded, 'none', 0.0, '1'),
    }


def fast_figures(place: Place, seconds: float, rounds: int, say: Say) -> dict[str, Comparison]:
    """Return the figures of the loop at 2 kHz."""
    graph: list[ChainRun] = []
    apart: list[ChainRun] = []
    for number in range(1, rounds + 1):
        say(f'graph and empty nodes at 2 kHz, round {number} of {rounds}')
        graph.append(run_graph(place, seconds, _FAST))
        apart.append(run_relay(place, seconds, _FAST))
    return {
        'latency_2_khz': _compared('setpoint latency, 2 kHz', graph, _APART, apart, 'latency'),
        'cpu_2_khz': _compared('driver, init, control, 2 kHz', graph, _APART, apart, 'cpu', 'cores'),
        'unanswered_2_khz': _compared('unanswered samples, 2 kHz', graph, _APART, apart, 'missing', '1'),
    }


def lockstep_figures(place: Place, seconds: float, rounds: int, say: Say) -> dict[str, Comparison]:
    """Return the samples per second in lock-step, plant and control included, all nodes in one process."""
    ours: list[float] = []
    other: list[float] = []
    for number in range(1, rounds + 1):
        say(f'graph and empty nodes in lock-step, round {number} of {rounds}')
        ours.append(_lockstep(place))
        other.append(relay_in_turn(place, seconds))
    return {
        'lockstep': Comparison(
            'samples in lock-step', statistics.median(ours), _COMPOSED, statistics.median(other), '1/s'
        )
    }


def _lockstep(place: Place) -> float:
    """Return the samples per second of the graph in lock-step, from its first answer to its last."""
    prepare_environment()
    sim = {'scenario': 'bench', 'timeline.duration': _LOCKSTEP_DRIVE}
    nodes = tuple(node for node in SIMULATED if node is not RECORDER)
    parameters: dict[str, dict[str, object]] = {node.name: {'lockstep': True} for node in nodes}
    parameters['mount_driver'] |= {'interface': 'virtual'}
    parameters['mount_sim'] |= {'interface': 'virtual', **sim}
    parameters['mount_init'] |= {'silence_timeout': 10.0}
    settings = GraphSettings(domain=place.domain, parameters=parameters, grouping=Grouping.TOGETHER)
    with tempfile.TemporaryDirectory() as folder, domain_lock(place.domain, ''):
        supervisor = Supervisor(nodes, settings, Path(folder))
        try:
            supervisor.start(lambda told: session_text({'parameters': told}), lambda words: None)
            supervisor.wait_until(
                lambda: supervisor.figures(SIM).get('sentence') == FINISHED, _LOCKSTEP_LIMIT, 'the end'
            )
            figures = supervisor.figures(SIM)
        finally:
            supervisor.stop()
    return float(figures['real_time_factor']) * int(figures['samples']) / float(figures['simulated_s'])


def _compared(
    what: str,
    ours: Sequence[ChainRun],
    other_name: str,
    other: Sequence[ChainRun],
    name: str,
    unit: str = 's',
) -> Comparison:
    return Comparison(what, _median(ours, name), other_name, _median(other, name), unit)


def _median(runs: Sequence[ChainRun], name: str) -> float:
    return statistics.median(getattr(run, name) for run in runs)
