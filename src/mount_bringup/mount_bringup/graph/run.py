"""The executable `mount_supervisor`: one graph from its arguments to its end, as the launch files start it.

`mount_supervisor vehicle channel:=can0 recording:=bags/first` takes the arguments of `vehicle.launch.py`.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rclpy.logging import get_logger

from mount_bringup.graph.domain import domain_lock
from mount_bringup.graph.nodes import SIM, GraphError
from mount_bringup.graph.order import LaunchOrder, launch_order
from mount_bringup.graph.shutdown import Interrupted, ending_signals
from mount_bringup.graph.supervisor import Parameters, Supervisor
from mount_recorder.session import new_session, session_text
from mount_ros.environment import prepare_environment
from mount_ros.nodes.shutdown import end_process

SUPERVISOR = 'mount_supervisor'


def main() -> None:
    """Run a graph; end with code 0 at its end or by a signal, with 1 after a refusal or a failure."""
    prepare_environment()
    end_process(run(sys.argv[1:]))


def run(command: Sequence[str]) -> int:
    """Run the graph of a command line and return the exit code."""
    try:
        order = launch_order(command)
        mounts = [node.mount for node in order.nodes]
        with (
            domain_lock(order.settings.domain, order.settings.namespace, mounts),
            tempfile.TemporaryDirectory(prefix=f'{SUPERVISOR}_') as folder,
        ):
            return _supervise(order, Path(folder))
    except ValueError as error:
        get_logger(SUPERVISOR).fatal(str(error))
        return 1


def _supervise(order: LaunchOrder, folder: Path) -> int:
    logger = get_logger(SUPERVISOR)

    def session(parameters: Parameters) -> str:
        scenario = parameters[SIM.name]['scenario'] if SIM.name in parameters else 'car'
        content = {'scenario': scenario, 'mode': 'real time', 'parameters': parameters}
        return session_text(new_session(content))

    graph = Supervisor(order.nodes, order.settings, folder)
    graph.recovery.report = logger.error
    code = 0
    with ending_signals(graph.interrupt):
        try:
            graph.start(session, logger.info)
            logger.info('all nodes are active')
            graph.wait_until(lambda: graph.finished, float('inf'), 'the end')
            logger.info('the end of the drive')
        except Interrupted:
            logger.info('interrupted')
        except GraphError as error:
            logger.error(str(error))
            code = 1
        finally:
            complaints = graph.stop() + [restart.sentence for restart in graph.recovery.restarts]
        for sentence in [*graph.notes, *complaints]:
            logger.warning(sentence)
    return 1 if complaints else code
