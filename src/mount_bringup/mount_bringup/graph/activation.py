"""Activates nodes side by side, and again where a refusal was not the fault of the mount."""

import time
from collections.abc import Callable, Sequence

from mount_bringup.graph.graph import ACTIVATE, DEACTIVATE, FRESH_DIAGNOSTICS, Graph
from mount_bringup.graph.nodes import DRIVER, SIM, GraphError, GraphNode
from mount_models.sampling import SAMPLE_RATE
from mount_ros.messages.verdicts import flags_of

_LATE_PATIENCE = 60.0  # s, chosen: until a machine that is too late for an activation is given up


def activate(
    graph: Graph, nodes: Sequence[GraphNode], report: Callable[[str], None] = lambda sentence: None
) -> None:
    """Activate nodes side by side; each may refuse as often as it declares, then raise `GraphError`.

    A refusal while the machine was late does not count, for a minute. Nor does one while the driver requests
    a new initialisation: the driver is deactivated and activated first.
    """
    begin, remaining = time.monotonic(), {node: node.activations for node in nodes}
    report(f'activating {", ".join(node.full_name for node in nodes)}')
    for node in nodes:
        graph.reports.observer.on_state(node, 'activating')
    while remaining:
        before = {node: _counts(graph, node) for node in remaining}
        refused = graph.change_states(list(remaining), ACTIVATE)
        for node in remaining.keys() - refused.keys():
            graph.reports.note_active(node)
        if refused:
            graph.serve_for(FRESH_DIAGNOSTICS)
        for node, refusal in refused.items():
            driver = _driver(graph, node)
            figures = graph.figures(driver)
            late = _was_late(before[node], _counts(graph, node))
            renewed = node != driver and flags_of(figures).needs_initialisation
            remaining[node] -= not (late or renewed)
            if not remaining[node] or time.monotonic() - begin > _LATE_PATIENCE:
                raise GraphError(refusal)
            if late:
                rate = float(figures.get('sample_rate', SAMPLE_RATE)) / 1000.0
                refusal = f'{refusal} (this machine was too late for {rate:g} kHz)'
            graph.repeats.setdefault(node.full_name, []).append(refusal)
            report(f'activating {node.full_name} again: {refusal}')
            if renewed:  # before that the driver sends no setpoint
                graph.repeats.setdefault(driver.full_name, []).append(figures['sentence'])
                graph.transition([driver], DEACTIVATE)
                graph.reports.forget(driver)  # the report is of the activation before
                graph.transition([driver], ACTIVATE)
                graph.reports.note_active(driver)
        remaining = {node: remaining[node] for node in refused}


def _driver(graph: Graph, node: GraphNode) -> GraphNode:
    """Return the driver of the mount of a node."""
    return next((each for each in graph.nodes if each.is_a(DRIVER) and each.mount == node.mount), DRIVER)


def _counts(graph: Graph, node: GraphNode) -> tuple[int, int, int]:
    """Return setpoints that were late, samples that were late, and all samples, as counted so far."""
    late = int(graph.figures(_driver(graph, node)).get('late_setpoints', 0))
    sim = graph.figures(SIM)
    return late, int(sim.get('overruns', 0)), int(sim.get('samples', 0))


def _was_late(before: tuple[int, int, int], now: tuple[int, int, int]) -> bool:
    """Return whether setpoints stopped, or more samples were late than the simulator tolerates."""
    timeouts, overruns, samples = (count - earlier for count, earlier in zip(now, before, strict=True))
    if overruns <= 0:
        return timeouts > 0
    from mount_sim.diagnosis import LATE_SHARE  # counted by the simulator alone

    return timeouts > 0 or overruns > LATE_SHARE * samples
