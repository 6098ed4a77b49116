"""The real mount_control beside a live replay, activated anew wherever the replay begins."""

import threading
import time

import numpy as np
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from engine_mount.drives.inputs.input import ReplayError
from engine_mount.drives.inputs.ramps import MeasuredGap
from engine_mount.settings.chosen import Parameters
from mount_control.node import MountControl
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.process import transition

_MATCH_LIMIT = 10.0  # s, chosen


class LiveControl:
    """mount_control in real time: `begin` activates it at a sample, `rest` takes it back."""

    def __init__(self, context: Context, namespace: str, parameters: Parameters, path: DataPath):
        values = {**parameters.get('mount_control', {}), 'lockstep': False}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        self._node = MountControl(context=context, namespace=namespace, parameter_overrides=overrides)
        self._node.get_logger().set_level(LoggingSeverity.WARN)  # this command speaks for it
        self._send = path.sender(topics.DISPLACEMENT)
        self._send_gap, self._send_table = (
            path.sender(topics.AIR_GAP),
            path.sender(topics.CURRENT_FORCE_TABLE),
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._guard = threading.Lock()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name='mount_control', daemon=True)
        self._thread.start()

    def begin(self, gap: MeasuredGap, sample: bytes) -> None:
        """Activate the controller with `gap` at a displacement message, as if measured just then."""
        self.rest()
        stamp = stamp_of(sample)
        layout = ScalarsLayout(topics.AIR_GAP)
        with self._guard:
            transition(self._node.trigger_configure, self._node, 'mount_control')
            self._wait_for_matches()
            self._send_gap(layout.pack(stamp, [gap.numbers[name] for name in layout.names]))
            table = np.stack([gap.table.current, gap.table.normal_force])
            self._send_table(table_message(stamp, table))
            self._send(sample)
            transition(self._node.trigger_activate, self._node, 'mount_control')

    def rest(self) -> None:
        """Take the controller back to its beginning, at 0 A."""
        with self._guard:
            if self._node.active:
                self._node.trigger_deactivate()
            if self._node.data_path is not None:
                self._node.trigger_cleanup()

    def close(self) -> None:
        """End the node and its thread."""
        self._ending.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.close()
        self._node.destroy_node()

    def _serve(self) -> None:
        while not self._ending.is_set():
            with self._guard:
                self._executor.spin_once(0.0)  # diagnostics
            self._ending.wait(0.02)

    def _wait_for_matches(self) -> None:
        needed = {topics.DISPLACEMENT.name, topics.AIR_GAP.name, topics.CURRENT_FORCE_TABLE.name}
        limit = time.monotonic() + _MATCH_LIMIT
        path = self._node.data_path
        assert isinstance(path, DataPath)
        while needed & {name.rsplit('/', 1)[-1] for name in path.unmatched()}:
            if time.monotonic() > limit:
                raise ReplayError('mount_control was not connected to the replay within 10 s')
            time.sleep(0.002)
