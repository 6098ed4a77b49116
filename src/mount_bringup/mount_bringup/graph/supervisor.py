"""The supervisor of a graph: processes up, transitions in order, watched, all down again."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import groupby, zip_longest
from pathlib import Path

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_srvs.srv import Trigger

from mount_bringup.graph.graph import CONFIGURE, LONGEST_HANG, SILENCE_LIMIT, Graph
from mount_bringup.graph.nodes import SIM, GraphError, GraphNode, GraphSettings, ending_order, groups
from mount_bringup.graph.processes import NodeProcess, end_processes
from mount_bringup.graph.recovery import NodesFailedError, Recovery
from mount_bringup.settings import settings_of_mount
from mount_ros.environment import loopback_refusal
from mount_ros.messages.verdicts import flags_of
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
        self.recovery = Recovery(self, self.processes)
        self._recovers = False

    def open(self) -> None:
        """Join the middleware, and offer `~/reinitialize`.

        The answer serves the executor meanwhile: its callback group has nothing else.
        """
        super().open()
        group = MutuallyExclusiveCallbackGroup()
        self.node.create_service(Trigger, '~/reinitialize', self._initialise_again, callback_group=group)

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
        # Those of one process in their order: its data thread serves those first that came last.
        for side_by_side in zip_longest(*of_processes):
            self.transition([node for node in side_by_side if node is not None], CONFIGURE)
        for process in self.processes:
            process.begun = True
        parameters = {node.full_name: self.parameters_of(node) for node in self.nodes}
        for mount in self.mounts:
            self.publish_session(mount, session(settings_of_mount(parameters, mount)))
        self.wait_for_matches()
        for _, of_mounts in groupby(self.nodes, lambda node: node.name):
            self.activate(list(of_mounts), report)
        self._recovers = not any(values.get('lockstep') for values in parameters.values())
        self.pause_silence()

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
                self.recovery.recover(failure)

    def stop(self) -> list[str]:
        """Deactivate all nodes and end; return a sentence per unclean end."""
        end_after(LONGEST_HANG)
        resting = [self.try_to_deactivate(node) for node in ending_order(self.nodes)]
        end_after(0.0)  # what follows has limits of its own, and its sentences must be reported
        complaints = end_processes(self.processes, at_once=all(resting))
        self.notes += [f'{reason}; it was activated again' for reason in self.repeats.values()]
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
        for node in self.nodes:
            figures = self.figures(node)
            flags, reason = flags_of(figures), f'{node.full_name}: {figures.get("sentence")}'
            if flags.fatal:
                raise GraphError(reason)
            if flags.needs_initialisation and self._recovers:
                raise NodesFailedError((), reason)
        if self._recovers and (silent := self.silent()):
            of_processes = [process.nodes for process in self.processes]
            hanging = [nodes for nodes in of_processes if {each.full_name for each in nodes} & {*silent}]
            raise NodesFailedError(
                [node for nodes in hanging for node in nodes],
                f'{", ".join(silent)}: no diagnostics for {SILENCE_LIMIT:g} s (limit {SILENCE_LIMIT:g} s): '
                'treated as failed; check its log and the CPU load',
            )

    @contextmanager
    def _recovery_paused(self) -> Iterator[None]:
        self._recovers = False
        try:
            yield
        finally:
            self._recovers = True
            self.pause_silence()

    def _initialise_again(self, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        if not self._recovers:
            answer.message = (
                'not initialised: the graph starts, recovers or runs in lock-step; try again when all nodes '
                'are active'
            )
            return answer
        with self._recovery_paused():
            try:
                answer.message = f'initialised anew; {self.recovery.initialise_again()}'
                answer.success = True
            except GraphError as error:
                answer.message = f'not initialised, the coil stays at 0 A: {error}'
        return answer
