"""The supervisor of a graph whose processes `ros2 launch` has started: the executable `mount_supervisor`."""

import argparse
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from rclpy.logging import get_logger
from std_msgs.msg import Float64MultiArray

from mount_bringup.graph.bringup import Bringup
from mount_bringup.graph.ending_signals import ending_signals
from mount_bringup.graph.errors import GraphError, Interrupted
from mount_bringup.graph.nodes import CONTROL, SIMULATED, GraphNode, GraphSettings, Grouping
from mount_bringup.graph.order import LaunchOrder
from mount_bringup.graph.player import Player
from mount_bringup.graph.restarts import Loss, NodesLostError, restartable
from mount_bringup.graph.siblings import Sibling, sibling_of
from mount_recorder.session import new_session, session_text
from mount_ros.environment import prepare_environment
from mount_ros.nodes.leaving import end_process
from mount_ros.nodes.starter import Starter
from mount_ros.qos import recording_qos
from mount_ros.topics import CURRENT_FORCE_TABLE

SUPERVISOR = 'mount_supervisor'
_RESPAWN_LIMIT = 10.0  # s, chosen
_LOOK_PERIOD = 0.1  # s, chosen


class LaunchedGraph(Bringup):
    """The nodes of a launch file, whose processes launch starts again; without launch this one ends too.

    With a `player` their inputs are a recording's: it begins when the control is to be activated.
    """

    def __init__(self, nodes: tuple[GraphNode, ...], settings: GraphSettings, player: Player | None = None):
        super().__init__(nodes, settings)
        self._player = player
        self._starter = Starter()
        self._processes: list[Sibling] = []

    def start_nodes(self) -> None:
        super().start_nodes()
        found = [sibling_of(group) for group in self._groups]
        self._processes = [process for process in found if process is not None]

    def check_processes(self) -> None:
        """Raise `NodesLostError` for a process that launch starts again; for any other it ends all."""
        if self._starter.ended:
            raise GraphError('launch has ended')
        for process in self._processes:
            if process.ended and restartable(process.nodes, self._settings.restart_limit):
                names = ' + '.join(node.name for node in process.nodes)
                raise NodesLostError(Loss(process.nodes, f'{names} has ended (process {process.pid})'))

    def await_inputs(self, nodes: Sequence[GraphNode], say: Callable[[str], None]) -> None:
        if self._player is None or not any(node.is_a(CONTROL) for node in nodes):
            return
        say('playing the recording up to its force table')
        tables: list[Float64MultiArray] = []
        kind, qos = Float64MultiArray, recording_qos(CURRENT_FORCE_TABLE)
        table = self._own.node.create_subscription(kind, CURRENT_FORCE_TABLE.name, tables.append, qos)
        self._player.begin()
        self.wait_until(lambda: bool(tables) or self.finished, float('inf'), 'the force table')
        self._own.node.destroy_subscription(table)
        if not tables:
            raise GraphError('the recording has ended, and no current_force_table came of it')

    @property
    def finished(self) -> bool:
        return super().finished if self._player is None else self._player.finished

    def leave(self) -> list[str]:
        if self._player is not None:
            self._player.end()
        return super().leave()

    def start_again(self, nodes: Sequence[GraphNode]) -> None:
        """Let launch respawn the processes of `nodes`, which it does when they end."""
        lost = [process for process in self._processes if {*process.nodes} & {*nodes}]
        if {*nodes} - {node for process in lost for node in process.nodes}:
            super().start_again(nodes)
        for process in lost:
            for node in process.nodes:
                self.verdicts.forget(node)
            process.kill()
            self._processes.remove(process)
            self._processes.append(self._respawned(process))
            process.close()

    def _respawned(self, dead: Sibling) -> Sibling:
        end = time.monotonic() + _RESPAWN_LIMIT
        while time.monotonic() < end:
            process = sibling_of(dead.nodes)
            if process is not None and process.pid != dead.pid:
                return process
            self.serve_for(_LOOK_PERIOD)
        raise GraphError(f'launch did not start {dead.nodes[0].name} again within {_RESPAWN_LIMIT:g} s')


def arguments_of(order: LaunchOrder) -> list[str]:
    """Return the command line by which `main` supervises the graph of `order`."""
    played = [f'--bag={order.bag}', f'--rate={order.rate}'] if order.bag else []
    return [
        *played,
        *(f'--node={node.full_name}' for node in order.nodes),
        f'--namespace={order.settings.namespace}',
        f'--domain={order.settings.domain}',
        f'--scenario={order.scenario}',
        f'--duration={order.duration}',
        f'--grouping={order.settings.grouping.name}',
        f'--restart-limit={order.settings.restart_limit}',
    ]


def _node(text: str) -> GraphNode:
    """Return the node of a full name such as `left/mount_driver`; raises `ValueError` for another one."""
    mount, _, name = text.rpartition('/')
    [node] = (node for node in SIMULATED if node.name == name)
    return replace(node, mount=mount)


def exit_error(name: str, code: int, asked: bool) -> str:
    """Return what is wrong with the end of a process of a launched graph, empty if nothing is.

    `asked`: all have been told to end. The supervisor also ends by itself, at the end of a drive.
    """
    if code == 0 and (asked or name == SUPERVISOR):
        return ''
    if asked and code == -signal.SIGINT:
        return ''  # it was told before it could listen
    reason = ', for the reason that it has told' if name == SUPERVISOR and code > 0 else ''
    return f'{name} ended with code {code}{reason}'


def main() -> None:
    """Bring the graph to life and watch it; end with code 0 at its end or by a signal, with 1 by a fault."""
    prepare_environment()
    parser = argparse.ArgumentParser(prog=SUPERVISOR, description=__doc__)
    parser.add_argument('--node', action='append', type=_node, required=True)
    parser.add_argument('--namespace', default='')
    parser.add_argument('--domain', type=int, required=True)
    parser.add_argument('--scenario', required=True)
    parser.add_argument('--duration', type=float, required=True, help='s; inf: until a signal')
    parser.add_argument('--grouping', choices=[entry.name for entry in Grouping], required=True)
    parser.add_argument('--restart-limit', type=int, required=True)
    parser.add_argument('--bag', type=Path, help='recording that is played to the control')
    parser.add_argument('--rate', type=float, default=1.0)
    chosen, _ = parser.parse_known_args()  # the rest is of ROS
    nodes = tuple(chosen.node)
    player = None
    if chosen.bag is not None:
        player = Player(chosen.bag, chosen.namespace, chosen.rate)
        nodes = tuple(replace(node, needs=()) for node in nodes)  # they come with the player
    settings = GraphSettings(
        namespace=chosen.namespace,
        domain=chosen.domain,
        grouping=Grouping[chosen.grouping],
        restart_limit=chosen.restart_limit,
    )
    graph = LaunchedGraph(nodes, settings, player)
    graph.tell_loss = get_logger(SUPERVISOR).error
    end_process(_supervise(graph, chosen.scenario, chosen.duration))


def _supervise(graph: Bringup, scenario: str, duration: float) -> int:
    logger = get_logger(SUPERVISOR)

    def session(parameters: dict[str, dict[str, object]]) -> str:
        return session_text(
            new_session({'scenario': scenario, 'mode': 'real time', 'parameters': parameters})
        )

    with ending_signals(graph.interrupt):
        try:
            graph.start(session, logger.info)
            logger.info('all nodes are active')
            end = time.monotonic() + duration
            graph.wait_until(
                lambda: graph.finished or time.monotonic() > end,
                float('inf'),
                'the end',
            )
            logger.info('the end of the drive')
            graph.stop()
        except Interrupted:
            graph.leave()  # launch has told the nodes too
        except GraphError as error:
            logger.error(str(error))
            graph.stop()
            return 1
        finally:
            for note in [*graph.notes, *(restart.sentence for restart in graph.restarts)]:
                logger.warning(note)
    return 1 if graph.restarts else 0


if __name__ == '__main__':
    main()
