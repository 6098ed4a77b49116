"""The supervisor of a graph: processes up, transitions in order, watched, all down again."""

from collections.abc import Callable
from functools import partial
from itertools import groupby, zip_longest
from pathlib import Path
from time import monotonic

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_srvs.srv import Trigger

from mount_bringup.graph.activation import Activation
from mount_bringup.graph.failures import NodeFailure, NodesFailedError
from mount_bringup.graph.graph import CONFIGURE, LONGEST_HANG, Graph
from mount_bringup.graph.nodes import (
    CONTROL,
    SIM,
    GraphError,
    GraphNode,
    GraphSettings,
    ending_order,
    groups,
    name_in,
)
from mount_bringup.graph.player import Player
from mount_bringup.graph.processes import NodeProcesses
from mount_bringup.graph.recovery import Recovery, initialise_again
from mount_bringup.graph.reports import silence_sentence
from mount_bringup.mounts import settings_of_mount
from mount_ros.environment import loopback_refusal
from mount_ros.nodes.process import Starter
from mount_ros.nodes.scheduling import drop_real_time, started_in_real_time
from mount_ros.nodes.shutdown import remove_abandoned

Parameters = dict[str, dict[str, object]]


class Supervisor(Graph):
    """The graph with its processes; `stop` always leaves the coil at 0 A.

    Parameter files and logs are in `folder`. With a `player` the inputs are those of a recording, which it
    plays as soon as the control can be activated. In real time, once all nodes are active, nodes that fail
    are started again as `recovery.py` says.
    """

    def __init__(
        self,
        nodes: tuple[GraphNode, ...],
        settings: GraphSettings,
        folder: Path,
        player: Player | None = None,
    ):
        super().__init__(nodes, settings)
        self._folder, self._player = folder, player
        self._starter = Starter()
        self._processes = NodeProcesses()
        self._activation = Activation(self)
        self.recovery = Recovery(self, self._processes, self._activation, settings.restart_limit)
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
        if inherited := drop_real_time():
            self.notes.append(started_in_real_time(inherited))
        self._processes.start(self.nodes, self.settings, self._folder)
        self.refuse_other_graph()  # while the processes load
        self._processes.begin()
        self.wait_for_services(self.nodes)
        # Those of one process in their order: its data thread serves those first that came last.
        for side_by_side in zip_longest(*groups(self.nodes, self.settings.grouping)):
            self.transition([node for node in side_by_side if node is not None], CONFIGURE)
        self.parameters = {node.full_name: self.parameters_of(node) for node in self.nodes}
        for mount in self.mounts:
            self.publish_session(mount, session(settings_of_mount(self.parameters, mount)))
        self.wait_for_matches()
        for _, of_mounts in groupby(self.nodes, lambda node: node.name):
            self._activate(list(of_mounts), report)
        lockstep = any(values.get('lockstep') for values in self.parameters.values())
        self._recovers = not lockstep
        self.reports.silence.pause()

    @property
    def finished(self) -> bool:
        """Whether the simulated drive or the played recording is over."""
        if self._player is not None:
            return self._player.finished
        if SIM not in self.nodes:
            return False
        from mount_sim.diagnosis import FINISHED  # not in the car

        return self.figures(SIM).get('sentence') == FINISHED

    def check(self) -> None:
        """Raise the reason why a wait must end; recover from the failure of a node."""
        super().check()
        try:
            self._check_nodes()
        except NodesFailedError as failed:
            if not self._recovers:
                raise
            self._recover(failed.failure)

    def stop(self) -> list[str]:
        """Deactivate all nodes and end; return a sentence per unclean end."""
        self.deadline.set(LONGEST_HANG)
        resting = [self.try_to_deactivate(node) for node in ending_order(self.nodes)]
        self.deadline.set(0.0)  # what follows has limits of its own, and its sentences must be reported
        if self._player is not None:
            self._player.end()
        complaints = self._processes.end(at_once=all(resting))
        self.close()
        remove_abandoned()
        return complaints

    def _activate(self, nodes: list[GraphNode], report: Callable[[str], None]) -> None:
        if self._player is not None and any(node.is_a(CONTROL) for node in nodes):
            report('playing the recording up to its force table')
            self._player.begin()
            if not self.wait_for_table(lambda: self.finished):
                raise GraphError('the recording has ended without a current_force_table')
        self._activation.activate(nodes, report)

    def _check_nodes(self) -> None:
        """Raise `GraphError` if the graph must end, as `NodesFailedError` if it can recover."""
        if self._starter.ended:
            raise GraphError(f'{self._starter.name} has ended')
        if process := self._processes.ended():
            words = process.last_words().split(']: ', 1)[-1]
            raise NodesFailedError(
                NodeFailure(
                    process.nodes,
                    f'{process.name} ended with code {process.exit_code}; last words: {words} '
                    f'(log: {process.log_file})',
                )
            )
        self.reports.check_fatal()
        if not self._recovers:
            return
        if silent := self.reports.silence.silent(monotonic()):
            hanging = [
                node
                for group in groups(self.nodes, self.settings.grouping)
                for node in group
                if {member.full_name for member in group} & {*silent}
            ]
            raise NodesFailedError(NodeFailure(tuple(hanging), silence_sentence(silent)))
        if reason := self.reports.initialisation_request():
            raise NodesFailedError(NodeFailure((), reason))

    def _recover(self, failure: NodeFailure) -> None:
        self._recovers = False
        try:
            self.recovery.recover(failure)
        except GraphError as error:
            if not self.finished:
                raise
            self.notes.append(f'{error}, at the end of the drive')
        finally:
            self._recovers = True
            self.reports.silence.pause()

    def _initialise_again(self, mount: str, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        if not self._recovers:
            answer.message = (
                'not initialised: the graph starts, recovers or runs in lock-step; try again when all nodes '
                'are active'
            )
            return answer
        self._recovers = False
        try:
            answer.message = f'initialised anew; {initialise_again(self, self._activation, mount)}'
            answer.success = True
        except GraphError as error:
            answer.message = f'not initialised, the coil stays at 0 A: {error}'
        finally:
            self._recovers = True
            self.reports.silence.pause()
        return answer
