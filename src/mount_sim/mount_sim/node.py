"""ROS 2 node of the simulator: parameters in, CAN frames and the rack's instruments out."""

import threading

import can
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Imu

from mount_driver.bus import open_bus
from mount_driver.parameters import DriverParameters
from mount_ros import topics
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.nodes.diagnostics import Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import declare, read
from mount_ros.nodes.process import run_node
from mount_sim.diagnosis import verdict
from mount_sim.electronics.can_end import CanEnd
from mount_sim.electronics.faults import Fault
from mount_sim.excitation.scenario import build_excitation
from mount_sim.loop import ElectronicsLoop, NoAnswerError
from mount_sim.parameters import SimParameters
from mount_sim.plant.simulated_mount import DivergedError, SimulatedMount

_UNKNOWN_ORIENTATION = -1.0  # sensor_msgs/Imu: first element of a covariance


class MountSim(SafeLifecycleNode):
    """Stands in for the hardware: everything behind the CAN connector."""

    def __init__(self, **arguments):
        super().__init__('mount_sim', **arguments)
        declare(self, SimParameters())
        self.declare_parameter('interface', 'udp_multicast')
        self.declare_parameter('channel', DriverParameters().channel)
        self.declare_parameter('port', DriverParameters().port)
        self.declare_parameter('answer_patience', 10.0)
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._loop: ElectronicsLoop | None = None
        self._can_end: CanEnd | None = None

    def configure(self) -> None:
        self._settings = read(self, SimParameters())
        self._excitation = build_excitation(self._settings)
        self._fault = Fault(self._settings.fault)
        self._truth = ScalarsLayout(topics.SIM_TRUTH)
        self._acceleration = OneNumberLayout(level_imu(), 'linear_acceleration.z')
        self._force = OneNumberLayout(WrenchStamped(), 'wrench.force.z')
        path = self.open_data_path()
        self._send_truth = path.sender(topics.SIM_TRUTH)
        self._send_acceleration = path.sender(topics.SIM_CHASSIS_ACCELERATION)
        self._send_force = path.sender(topics.SIM_MOUNT_FORCE)
        path.start()
        self._path = path
        self._prepare_mount()

    def activate(self) -> None:
        interface = self.get_parameter('interface').value
        bus = open_bus(
            interface,
            self.get_parameter('channel').value,
            port=self.get_parameter('port').value,
        )
        if self._mount.sample:
            self._prepare_mount()
        self._can_end = CanEnd(bus)
        self._loop = ElectronicsLoop(
            self._mount, self._can_end, self._settings.electronics, self._fault, self._publish
        )
        self._ending.clear()
        self._time_zero = 0 if self.lockstep else self.get_clock().now().nanoseconds
        self._patience = self.get_parameter('answer_patience').value
        if self.lockstep and interface == 'virtual':
            # Both ends of the bus are in this process: the answering node works in the data thread.
            self._path.attend(self._step)
        else:
            self._thread = threading.Thread(target=self._run, name='electronics', daemon=True)
            self._thread.start()

    def deactivate(self) -> None:
        self._ending.set()
        self._path.leave_work()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._can_end is not None:
            self._can_end.close()
            self._can_end = None

    def judge(self) -> Verdict:
        assert self._loop is not None
        return verdict(self._loop.figures, self._mount.run, lockstep=self.lockstep)

    def _prepare_mount(self) -> None:
        self._mount, rehearsal = (
            SimulatedMount(
                self._settings.plant, self._excitation, self._settings.seed, self._settings.sample_rate
            )
            for _ in range(2)
        )
        rehearsal.measure()  # loads the compiled plant before simulated time begins
        rehearsal.advance(0.0)

    def _run(self) -> None:
        assert self._loop is not None
        try:
            if self.lockstep:
                self._loop.run_in_lockstep(self._ending, self._patience)
            else:
                self._loop.run_in_real_time(self._ending)
        except Exception as error:  # the border of the thread, whatever the reason
            self._fail(error)

    def _step(self) -> bool:
        loop = self._loop
        if loop is None or loop.figures.failure:
            return False
        try:
            return loop.step_in_lockstep(self._patience)
        except Exception as error:  # the same
            self._fail(error)
            return False

    def _fail(self, error: Exception) -> None:
        assert self._loop is not None
        known = isinstance(error, (NoAnswerError, DivergedError, OSError, can.CanError))
        sentence = str(error) if known else f'the run has ended: {type(error).__name__}: {error}'
        self._loop.figures.failure = sentence
        self.get_logger().error(sentence)

    def _publish(self, number: int) -> None:
        stamp = self._time_zero + number * self._mount.sample_time
        truth = self._mount.truth
        if self._loop is not None and not self.lockstep:
            truth['setpoint_latency'] = self._loop.last_latency
        self._send_truth(self._truth.pack_record(stamp, self._mount.truth_bytes))
        self._send_acceleration(self._acceleration.pack(stamp, truth['chassis_acceleration']))
        self._send_force(self._force.pack(stamp, truth['mount_force']))


def level_imu() -> Imu:
    """Return the message of an accelerometer that knows neither orientation nor rotation."""
    message = Imu()
    message.header.frame_id = 'mount_chassis'
    message.orientation_covariance[0] = _UNKNOWN_ORIENTATION
    message.angular_velocity_covariance[0] = _UNKNOWN_ORIENTATION
    return message


def main() -> None:
    """Run the node as a process."""
    run_node(MountSim)
