"""Activates nodes side by side, and again where a refusal was not the fault of the mount."""

import time
from collections.abc import Callable, Sequence

from mount_bringup.graph.graph import ACTIVATE, DEACTIVATE, FRESH_DIAGNOSTICS, Graph
from mount_bringup.graph.nodes import DRIVER, SIM, GraphError, GraphNode
from mount_models.sampling import SAMPLE_RATE
from mount_ros.messages.verdicts import flags_of

_LATE_PATIENCE = 60.0  # s, chosen: until a machine that is too late for an activation is given up


class Activation:
    """Takes nodes to their active state."""

    def __init__(self, graph: Graph):
        self._graph = graph
        self._noted: dict[str, tuple[int, int]] = {}  # node -> place in the notes, and how often

    def activate(
        self, nodes: Sequence[GraphNode], report: Callable[[str], None] = lambda sentence: None
    ) -> None:
        """Activate nodes side by side; each may refuse as often as it declares, then raise `GraphError`.

        A refusal while the machine was late does not count, for a minute. Nor does one while the driver
        requests a new initialisation: the driver is deactivated and activated first.
        """
        begin, remaining = time.monotonic(), {node: node.activations for node in nodes}
        report(f'activating {", ".join(node.full_name for node in nodes)}')
        for node in nodes:
            self._graph.reports.observer.on_state(node, 'activating')
        while remaining:
            before = {node: self._counts(node) for node in remaining}
            refused = self._graph.change_states(list(remaining), ACTIVATE)
            for node in remaining.keys() - refused.keys():
                self._graph.reports.note_active(node)
            if refused:
                self._graph.serve_for(FRESH_DIAGNOSTICS)
            for node, refusal in refused.items():
                late = self._was_late(before[node], self._counts(node))
                remaining[node] -= not (late or self._needs_initialisation(node))
                if not remaining[node] or time.monotonic() - begin > _LATE_PATIENCE:
                    raise GraphError(refusal)
                if late:
                    rate = float(self._driver(node)[1].get('sample_rate', SAMPLE_RATE))
                    refusal = f'{refusal} (this machine was too late for {rate / 1000.0:g} kHz)'
                self._note(node, refusal)
                report(f'activating {node.full_name} again: {refusal}')
                self._renew_driver(node)
            remaining = {node: remaining[node] for node in refused}

    def _renew_driver(self, node: GraphNode) -> None:
        """Activate the driver anew where it sends no setpoint before that."""
        if self._needs_initialisation(node):
            driver, figures = self._driver(node)
            self._note(driver, figures.get('sentence', ''))
            self._graph.transition([driver], DEACTIVATE)
            self._graph.reports.forget(driver)  # the report is of the activation before
            self._graph.transition([driver], ACTIVATE)
            self._graph.reports.note_active(driver)

    def _needs_initialisation(self, node: GraphNode) -> bool:
        return not node.is_a(DRIVER) and flags_of(self._driver(node)[1]).needs_initialisation

    def _note(self, node: GraphNode, reason: str) -> None:
        """Note why a node was activated again: one note for each node, of the last time, with a count."""
        place, count = self._noted.get(node.full_name, (len(self._graph.notes), 0))
        self._noted[node.full_name] = place, count + 1
        times = f', the last of {count + 1} times' if count else ''
        self._graph.notes[place : place + 1] = [f'{reason}; it was activated again{times}']

    def _counts(self, node: GraphNode) -> tuple[int, int, int]:
        """Return setpoints that were late, samples, and samples that were late, as counted so far."""
        driver, sim = self._driver(node)[1], self._graph.figures(SIM)
        return (
            int(driver.get('late_setpoints', 0)),
            int(sim.get('samples', 0)),
            int(sim.get('overruns', 0)),
        )

    def _was_late(self, before: tuple[int, int, int], now: tuple[int, int, int]) -> bool:
        """Return whether setpoints stopped, or more samples were late than the simulator tolerates."""
        timeouts, samples, overruns = (count - earlier for count, earlier in zip(now, before, strict=True))
        if overruns <= 0:
            return timeouts > 0
        from mount_sim.diagnosis import LATE_SHARE  # counted by the simulator alone

        return timeouts > 0 or overruns > LATE_SHARE * samples

    def _driver(self, node: GraphNode) -> tuple[GraphNode, dict[str, str]]:
        """Return the driver of the mount of a node, and its last report."""
        drivers = (other for other in self._graph.nodes if other.is_a(DRIVER) and other.mount == node.mount)
        driver = next(drivers, DRIVER)
        return driver, self._graph.figures(driver)
