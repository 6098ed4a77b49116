"""The supervisor of a graph: processes up, transitions in order, watched, all down again."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import groupby, zip_longest
from pathlib import Path

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_srvs.srv import Trigger

from mount_bringup.graph.activation import activate
from mount_bringup.graph.graph import CONFIGURE, LONGEST_HANG, Graph
from mount_bringup.graph.nodes import SIM, GraphError, GraphNode, GraphSettings, ending_order, groups, name_in
from mount_bringup.graph.processes import NodeProcess, end_processes
from mount_bringup.graph.recovery import NodesFailedError, Recovery
from mount_bringup.graph.reports import SILENCE_LIMIT
from mount_bringup.settings import settings_of_mount
from mount_ros.environment import loopback_refusal
from mount_ros.nodes.process import Starter
from mount_ros.nodes.shutdown import end_after, remove_abandoned

Parameters = dict[str, dict[str, object]]


class Supervisor(Graph):
    """The graph with its processes; `stop` always leaves the coil at 0 A.

    Parameter files and logs are in `folder`. In real time, once all nodes are active, nodes that fail are
    started again as `recovery.py` says.
    """

    def __init__(self, nodes: tuple[GraphNode, ...], settings: GraphSettings, folder: Path):
        super().__init__(nodes, settings)
        self._folder = folder
        self._starter = Starter()
        self.processes: list[NodeProcess] = []
        self.recovery = Recovery(self, self.processes, partial(activate, self))
        self._recovers = False

    def open(self) -> None:
        """Join the middleware, and offer `~/reinitialize`, of one of several mounts `~/<mount>/reinitialize`.

        The answer serves the executor meanwhile: its callback group has nothing else.
        """
        super().open()
        group = MutuallyExclusiveCallbackGroup()
        for mount in dict.fromkeys(['', *self.mounts]):
            service, take = f'~/{name_in(mount, "reinitialize")}', partial(self._initialise_again, mount)
            self.node.create_service(Trigger, service, take, callback_group=group)

    def start(self, session: Callable[[Parameters], str], report: Callable[[str], None]) -> None:
        """Start all nodes; `session` makes the session text of a mount from the parameters of its nodes."""
        if refusal := loopback_refusal():
            raise GraphError(refusal)
        remove_abandoned()
        self.open()
        report('starting the nodes')
        of_processes = groups(self.nodes, self.settings.grouping)
        for group in of_processes:
            self.processes.append(NodeProcess(group, self.settings, self._folder))
        self.refuse_other_graph()  # while the processes load
        for process in self.processes:
            process.begin()
        # Those of one process in their order: its data thread serves those first that came last.
        for side_by_side in zip_longest(*of_processes):
            self.transition([node for node in side_by_side if node is not None], CONFIGURE)
        parameters = {node.full_name: self.parameters_of(node) for node in self.nodes}
        for mount in self.mounts:
            self.publish_session(mount, session(settings_of_mount(parameters, mount)))
        self.wait_for_matches()
        for _, of_mounts in groupby(self.nodes, lambda node: node.name):
            activate(self, list(of_mounts), report)
        self._recovers = not any(values.get('lockstep') for values in parameters.values())
        self.reports.pause_silence()

    @property
    def finished(self) -> bool:
        """Whether the simulated drive is over."""
        if SIM not in self.nodes:
            return False
        from mount_sim.diagnosis import FINISHED  # not in the car

        return self.figures(SIM).get('sentence') == FINISHED

    def check(self) -> None:
        """Raise the reason why a wait must end; recover from the failure of a node."""
        super().check()
        try:
            self._check_nodes()
        except NodesFailedError as failure:
            if not self._recovers:
                raise
            with self._recovery_paused():
                try:
                    self.recovery.recover(failure)
                except GraphError as error:
                    if not self.finished:
                        raise
                    self.notes.append(f'{error}, at the end of the drive')

    def stop(self) -> list[str]:
        """Deactivate all nodes and end; return a sentence per unclean end."""
        end_after(LONGEST_HANG)
        resting = [self.try_to_deactivate(node) for node in ending_order(self.nodes)]
        end_after(0.0)  # what follows has limits of its own, and its sentences must be reported
        complaints = end_processes(self.processes, at_once=all(resting))
        for reasons in self.repeats.values():
            times = f', the last of {len(reasons)} times' if len(reasons) > 1 else ''
            self.notes.append(f'{reasons[-1]}; it was activated again{times}')
        self.close()
        remove_abandoned()
        return complaints

    def _check_nodes(self) -> None:
        """Raise `GraphError` if the graph must end, as `NodesFailedError` if it can recover."""
        if self._starter.ended:
            raise GraphError(f'{self._starter.name} has ended')
        for process in self.processes:
            if process.exit_code is not None:
                process.reported = True
                words = process.last_words().split(']: ', 1)[-1]
                reason = f'{process.name} ended with code {process.exit_code}; last words: {words}'
                raise NodesFailedError(process.nodes, reason)
        self.reports.check_fatal()
        if not self._recovers:
            return
        if silent := self.reports.silent():
            hanging = [process.nodes for process in self.processes]
            hanging = [nodes for nodes in hanging if {node.full_name for node in nodes} & {*silent}]
            raise NodesFailedError(
                sum(hanging, ()),
                f'{", ".join(silent)}: no diagnostics for {SILENCE_LIMIT:g} s (limit {SILENCE_LIMIT:g} s): '
                'treated as failed; check its log and the CPU load',
            )
        if reason := self.reports.initialisation_request():
            raise NodesFailedError((), reason)

    @contextmanager
    def _recovery_paused(self) -> Iterator[None]:
        self._recovers = False
        try:
            yield
        finally:
            self._recovers = True
            self.reports.pause_silence()

    def _initialise_again(self, mount: str, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        if not self._recovers:
            answer.message = (
                'not initialised: the graph starts, recovers or runs in lock-step; try again when all nodes '
                'are active'
            )
            return answer
        with self._recovery_paused():
            try:
                answer.message = f'initialised anew; {self.recovery.initialise_again(mount)}'
                answer.success = True
            except GraphError as error:
                answer.message = f'not initialised, the coil stays at 0 A: {error}'
        return answer
