"""Starts the graph where there is no launch: processes up, transitions in order, all down again."""

from collections.abc import Sequence
from pathlib import Path

from mount_bringup.graph.bringup import Bringup
from mount_bringup.graph.nodes import GraphNode, GraphSettings
from mount_bringup.graph.processes import NodeProcess, end_all, start_processes
from mount_bringup.graph.restarts import Loss, NodesLostError
from mount_ros.nodes.scheduling import drop_real_time, started_in_real_time


class Supervisor(Bringup):
    """The graph with its processes, whose output goes to `folder`; `stop` always leaves the coil at 0 A."""

    def __init__(self, nodes: tuple[GraphNode, ...], settings: GraphSettings, folder: Path):
        super().__init__(nodes, settings)
        self._folder = folder
        self._processes: list[NodeProcess] = []

    def start_nodes(self) -> None:
        inherited = drop_real_time()
        if inherited:
            self.notes.append(started_in_real_time(inherited))
        self._processes = start_processes(self.nodes, self._settings, self._folder)
        self.refuse_others(own=0)  # while they load
        for process in self._processes:
            process.begin()

    def check_processes(self) -> None:
        for process in self._processes:
            if process.exit_code is not None:
                process.reported = True
                words = process.last_words().split(']: ', 1)[-1]
                said = f'its last words were: {words} (log: {process.log_file})'
                reason = f'{process.name} ended with code {process.exit_code}; {said}'
                raise NodesLostError(Loss(process.nodes, reason))

    def start_again(self, nodes: Sequence[GraphNode]) -> None:
        for process in self._processes:
            if {*process.nodes} & {*nodes}:
                for node in process.nodes:
                    self.verdicts.forget(node)
                process.start_again()

    def leave(self) -> list[str]:
        self._deadline.set(0.0)  # what follows has limits of its own, and its sentences shall be told
        complaints = end_all(self._processes, at_once=self.at_rest)
        return [*complaints, *super().leave()]
