"""ROS 2 node of the simulator: parameters in, CAN frames and the rack's instruments out."""

import threading
import time
from collections.abc import Mapping
from copy import deepcopy
from functools import partial
from typing import Any

import numpy as np
from std_srvs.srv import SetBool

from mount_driver.bus import open_bus
from mount_driver.can_library import can
from mount_driver.parameters import DriverParameters
from mount_models.arithmetic.compiled import log_compilation
from mount_models.quantity import ParameterError, flattened
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import accelerometer, wrench
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.nodes.diagnostics import SlidingWindow, Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node
from mount_ros.nodes.real_time import RealTimeThreads
from mount_ros.private_rclpy import given_at_start
from mount_sim.diagnosis import Counted, counted, verdict
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.faults import injected_faults
from mount_sim.electronics.own_law import OwnLaw
from mount_sim.electronics.vehicle_bus import speed_frame
from mount_sim.excitation.building import build_excitation
from mount_sim.loop import CarLoop, ElectronicsLoop, NoAnswerError
from mount_sim.parameters import NodeParameters, SimParameters
from mount_sim.plant.mounts import ALONE, general_name, mount_names, texts_of_mount, values_of_mount
from mount_sim.plant.simulated_car import DivergedError, SimulatedCar

INJECT = 'inject'
"""The parameter whose faults the service `~/inject_fault` begins."""
_OF_ELECTRONICS = ('channel', 'port', 'controller_library')


class MountSim(SafeLifecycleNode):
    """Stands in for the hardware: everything behind the CAN connectors of one mount or of several."""

    run_time_parameters = frozenset({INJECT})
    real_time_threads = RealTimeThreads(frozenset({'electronics'}))

    def __init__(self, **arguments):
        super().__init__('mount_sim', **arguments)
        declare(self, SimParameters())
        declare(self, DriverParameters(), only=('interface', 'channel', 'port'))
        declare(self, NodeParameters())
        self.create_service(SetBool, '~/inject_fault', self._inject)
        self._own = _declare_own(self)
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._loop: CarLoop | None = None
        self._loops: dict[str, ElectronicsLoop] = {}
        self._can_ends: list[CanEnd] = []
        self._counted: SlidingWindow[dict[str, Counted]] = SlidingWindow({})

    def configure(self) -> None:
        self._settings = read(self, SimParameters())
        other = {name: self.get_parameter(name).value for name in (*_OF_ELECTRONICS, *self._own)}
        self._values = flattened(self._settings) | other
        self._names = mount_names(self._settings.mounts) or (ALONE,)
        with log_compilation(self.get_logger().info):
            self._excitation = build_excitation(self._settings)
            self._prepare_mounts()
        path = self.open_data_path()
        self._instruments = {name: _Instruments(path, name) for name in self._names}
        path.start()
        self._path = path

    def activate(self) -> None:
        interface = self.get_parameter('interface').value
        if any(mount.sample for mount in self._mounts.values()):
            self._prepare_mounts()
        rate, drift = self._settings.sample_rate, self._settings.electronics.clock_drift
        self._loops = {}
        for name, mount in self._mounts.items():
            own = values_of_mount(self._values, name)
            law = OwnLaw(own['controller_library'], rate) if own['controller_library'] else None
            can_end = CanEnd(open_bus(interface, own['channel'], port=own['port']), rate, law)
            self._can_ends.append(can_end)
            speed = speed_frame(idle.frequency) if (idle := self._settings.idle).speed_sent else None
            self._loops[name] = ElectronicsLoop(mount, can_end, partial(self._publish, name), speed)
        self._loop = CarLoop(self._loops, drift, rate)
        self._counted = SlidingWindow({})
        self._ending.clear()
        self._time_zero = 0 if self.lockstep else self.get_clock().now().nanoseconds
        self._patience = self.get_parameter('answer_patience').value
        if self.lockstep:
            # Both ends of the bus are in this process: the answering node works in the data thread.
            self._path.add_poll(self._step)
        else:
            self._thread = threading.Thread(target=self._run, name='electronics', daemon=True)
            self._thread.start()

    def deactivate(self) -> None:
        self._ending.set()
        self._path.remove_polls()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        while self._can_ends:
            self._can_ends.pop().close()

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        for texts in self._injected(values[INJECT]).values():
            injected_faults(texts)

    def judge(self) -> Verdict:
        figures = {name: loop.figures for name, loop in self._loops.items()}
        run = next(iter(self._mounts.values())).run
        now = {name: counted(each) for name, each in figures.items()}
        earlier = self._counted.earlier(time.monotonic(), now)
        return verdict(figures, run, earlier, lockstep=self.lockstep)

    def _injected(self, text: str) -> dict[str, str]:
        """Return the faults to inject by mount."""
        parts = [part.strip() for part in text.split(',')]
        return {name: ', '.join(texts_of_mount(parts, name, self._names)) for name in self._names}

    def _inject(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Begin the faults that `inject` names, or end all that were begun so."""
        try:
            if not self.active:
                raise ParameterError('mount_sim is not active: activate it first')
            told = self._injected(str(self.get_parameter(INJECT).value))
            said = []
            for name, mount in self._mounts.items():
                if told[name] or not request.data or name == ALONE:
                    what = mount.faults.inject(told[name]) if request.data else mount.faults.end_injected()
                    said.append(f'{name}: {what}' if name else what)
            response.message, response.success = '; '.join(said), True
            self.get_logger().warning(f'injected faults {response.message}')
        except ParameterError as error:
            response.message = str(error)
        return response

    def _prepare_mounts(self) -> None:
        self._mounts = SimulatedCar(self._values, self._excitation).mounts
        for mount in SimulatedCar({**self._values, 'faults': ()}, self._excitation).mounts.values():
            mount.measure()  # a rehearsal: loads the compiled plant before simulated time begins
            mount.advance(0.0)

    def _run(self) -> None:
        assert self._loop is not None
        try:
            self._loop.run_in_real_time(self._ending)
        except Exception as error:  # the border of the thread, whatever the reason
            self._fail(error)

    def _step(self) -> bool:
        loop = self._loop
        if loop is None or any(each.figures.failure for each in self._loops.values()):
            return False
        try:
            return loop.step_in_lockstep(self._patience)
        except Exception as error:  # the same
            self._fail(error)
            return False

    def _fail(self, error: Exception) -> None:
        known = isinstance(error, (NoAnswerError, DivergedError, OSError, can.CanError))
        sentence = str(error) if known else f'the run has ended: {type(error).__name__}: {error}'
        for loop in self._loops.values():
            loop.figures.failure = sentence
        self.get_logger().error(sentence)

    def _publish(self, name: str, number: int) -> None:
        mount = self._mounts[name]
        truth = mount.truth
        if not self.lockstep:
            truth['setpoint_latency'] = self._loops[name].last_latency
        stamp = self._time_zero + number * mount.sample_time
        self._instruments[name].publish(stamp, truth, mount.truth_bytes)


def _declare_own(node: SafeLifecycleNode) -> list[str]:
    """Declare the parameters of single mounts that were given at the start and return their names."""
    own = []
    for name in sorted(given_at_start(node)):
        try:
            general = general_name(name)
        except ParameterError:
            continue  # it is refused as unknown when the node is configured
        if general != name and node.has_parameter(general):
            node.declare_parameter(
                name, node.get_parameter(general).value, deepcopy(node.describe_parameter(general))
            )
            own.append(name)
    return own


class _Instruments:
    """Publishes truth, acceleration and force of one mount, the one `name` of several or the only one."""

    def __init__(self, path: DataPath, name: str = ''):
        self._truth = ScalarsLayout(topics.SIM_TRUTH)
        self._acceleration = OneNumberLayout(accelerometer)
        self._force = OneNumberLayout(wrench)
        self._send_truth = path.sender(topics.SIM_TRUTH, name)
        self._send_acceleration = path.sender(topics.SIM_CHASSIS_ACCELERATION, name)
        self._send_force = path.sender(topics.SIM_MOUNT_FORCE, name)

    def publish(self, stamp: int, truth: np.void, truth_bytes: bytes) -> None:
        """Publish what was true at the time `stamp` (ns)."""
        self._send_truth(self._truth.pack_record(stamp, truth_bytes))
        self._send_acceleration(self._acceleration.pack(stamp, truth['chassis_acceleration']))
        self._send_force(self._force.pack(stamp, truth['mount_force']))


def main() -> None:
    """Run the node as a process."""
    run_node(MountSim)
