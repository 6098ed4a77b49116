"""The one declaration of every topic: name, type, delivery, rate, and the scalars that it carries.

Names are relative, so that several mounts live in one car under namespaces. SI units, and
degC where a type demands it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

from mount_models.quantity import nearest
from mount_models.sampling import SAMPLE_RATE

JOINT_STATE = 'sensor_msgs/msg/JointState'


class Delivery(Enum):
    """How a topic travels; `mount_ros.qos` turns it into a quality of service."""

    STREAM = 'stream'  # data at a rate of its own: reliable publisher, keep last
    LATCHED = 'latched'  # reliable, transient local: late subscribers get the last one
    MARK = 'mark'  # occasional and never to be lost: reliable, keep last


@dataclass(frozen=True)
class Scalar:
    """One named number of a `JointState`: unit of its position, and of its velocity where it has one."""

    name: str
    unit: str
    derivative_unit: str = ''


@dataclass(frozen=True)
class Topic:
    """A topic of the graph; `rate` is in Hz at the default sample rate, 0 for topics without their own."""

    name: str
    type: str
    delivery: Delivery
    rate: float
    content: str
    scalars: tuple[Scalar, ...] = ()
    optional: tuple[Scalar, ...] = ()  # that some senders name between them
    writers: tuple[str, ...] = ()  # the only nodes that may publish it, one at a time; empty: any

    def rate_at(self, sample_rate: float) -> float:
        """Return the rate (Hz) of a graph that samples at `sample_rate` (Hz)."""
        return sample_rate if self.rate == SAMPLE_RATE else self.rate

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the scalars in the order of the message."""
        return tuple(scalar.name for scalar in self.scalars)

    def unit(self, name: str) -> str:
        """Return the unit of a scalar, empty where it is not known here."""
        return next((scalar.unit for scalar in (*self.scalars, *self.optional) if scalar.name == name), '')

    @property
    def has_derivatives(self) -> bool:
        """Whether the message fills `velocity`."""
        return any(scalar.derivative_unit for scalar in self.scalars)


DISPLACEMENT = Topic(
    'displacement',
    JOINT_STATE,
    Delivery.STREAM,
    SAMPLE_RATE,
    'displacement of the mount, engine minus chassis; NaN where the sensor says that it is invalid',
    (Scalar('mount', 'm'),),
    writers=('mount_driver',),
)

COIL_RIPPLE = Topic(
    'coil_ripple',
    JOINT_STATE,
    Delivery.STREAM,
    SAMPLE_RATE,
    'mean coil current, and the slopes of current and flux density 18 us after switching',
    (Scalar('coil_current', 'A', 'A/s'), Scalar('flux_density', 'T', 'T/s')),
    writers=('mount_driver',),
)

COIL_TEMPERATURE = Topic(
    'coil_temperature',
    'sensor_msgs/msg/Temperature',
    Delivery.STREAM,
    10.0,
    'temperature of the coil in degC as its type demands; silent while the electronics have no reading',
    writers=('mount_driver',),
)

CURRENT_SETPOINT = Topic(
    'current_setpoint',
    JOINT_STATE,
    Delivery.STREAM,
    SAMPLE_RATE,
    'wanted coil current; its stamp is that of the displacement sample that it answers',
    (Scalar('coil_current', 'A'),),
    writers=('mount_control', 'mount_init'),
)

ENGINE_SPEED = Topic(
    'engine_speed',
    JOINT_STATE,
    Delivery.STREAM,
    0.0,
    'speed of the crankshaft, 10 to 100 Hz, where the vehicle sends it; position always NaN',
    (Scalar('crankshaft', 'rad', 'rad/s'),),
    writers=('mount_driver',),
)

AIR_GAP = Topic(
    'air_gap',
    JOINT_STATE,
    Delivery.LATCHED,
    0.0,
    'result of the initialisation; its stamp names the activation',
    (
        Scalar('rest_gap', 'm'),
        Scalar('contact_gap', 'm'),
        Scalar('rest_gap_std', 'm'),
        Scalar('contact_gap_std', 'm'),
        Scalar('contact_force', 'N'),
        Scalar('offset_current', 'A'),
    ),
    writers=('mount_init',),
)

CURRENT_FORCE_TABLE = Topic(
    'current_force_table',
    'std_msgs/msg/Float64MultiArray',
    Delivery.LATCHED,
    0.0,
    '2 x N, rows `current` (A) and `normal_force` (N); the column label carries the stamp of its air_gap',
    writers=('mount_init',),
)

CONTROL_TRACE = Topic(
    'control_trace',
    JOINT_STATE,
    Delivery.STREAM,
    SAMPLE_RATE,
    'every intermediate of one control step; between crank_frequency and damping_active those of the policy',
    (
        Scalar('displacement', 'm'),
        Scalar('velocity', 'm/s'),
        Scalar('damping_active', '1'),
        Scalar('desired_force', 'N'),
        Scalar('friction_deflection', 'm'),
        Scalar('friction_coefficient', '1'),
        Scalar('normal_force', 'N'),
        Scalar('current', 'A'),
        Scalar('bridged_samples', '1'),
    ),
    (
        Scalar('crank_frequency', 'Hz'),  # not in older recordings
        Scalar('band_displacement', 'm'),
        Scalar('band_velocity', 'm/s'),
        Scalar('predicted_velocity', 'm/s'),
        Scalar('magnitude', 'm'),
        Scalar('amplitude', 'm'),
        Scalar('line_amplitude', 'm'),
        Scalar('line_frequency', 'Hz'),
        Scalar('engine_velocity', 'm/s'),
    ),
)

ELECTRONICS_TABLE = Topic(
    'electronics_table',
    'std_msgs/msg/Float64MultiArray',
    Delivery.LATCHED,
    0.0,
    'for the law in the electronics: current (A), normal force (N) of each point; first the offset current '
    'and 0 N, then the table; empty while mount_control is not active',
    writers=('mount_control',),
)

ELECTRONICS_SETPOINT = Topic(
    'electronics_setpoint',
    JOINT_STATE,
    Delivery.STREAM,
    0.0,
    'setpoint by the law in the electronics; its stamp is that of the displacement sample that it answers',
    (Scalar('coil_current', 'A'), Scalar('table_loaded', '1')),
    writers=('mount_driver',),
)

DIAGNOSTICS = Topic(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    Delivery.MARK,
    0.0,
    'state of each node: level and a sentence with value, limit and remedy',
)

SESSION = Topic(
    'session',
    'std_msgs/msg/String',
    Delivery.LATCHED,
    0.0,
    'what this recording is, YAML: scenario, all parameters, versions',
)

EVENT = Topic('event', 'std_msgs/msg/String', Delivery.MARK, 0.0, 'something worth finding again, YAML')

SIM_TRUTH = Topic(
    'sim/truth',
    JOINT_STATE,
    Delivery.STREAM,
    SAMPLE_RATE,
    'what no sensor sees; only the simulator has it',
    (
        Scalar('displacement', 'm'),
        Scalar('velocity', 'm/s'),
        Scalar('coil_current', 'A'),
        Scalar('current_setpoint', 'A'),
        Scalar('gap', 'm'),
        Scalar('flux_density', 'T'),
        Scalar('normal_force', 'N'),
        Scalar('friction_force', 'N'),
        Scalar('mount_force', 'N'),
        Scalar('road_height', 'm'),
        Scalar('engine_displacement', 'm'),
        Scalar('chassis_displacement', 'm'),
        Scalar('chassis_acceleration', 'm/s^2'),
        Scalar('rest_gap', 'm'),
        Scalar('contact_gap', 'm'),
        Scalar('setpoint_latency', 's'),
    ),
)

SIM_CHASSIS_ACCELERATION = Topic(
    'sim/chassis_acceleration',
    'sensor_msgs/msg/Imu',
    Delivery.STREAM,
    SAMPLE_RATE,
    "the test rack's accelerometer at the chassis side: linear_acceleration.z, upwards, m/s^2",
)

SIM_MOUNT_FORCE = Topic(
    'sim/mount_force',
    'geometry_msgs/msg/WrenchStamped',
    Delivery.STREAM,
    SAMPLE_RATE,
    "the test rack's load cell: wrench.force.z, force of the mount on the chassis, N",
)

SIM_CLAMP_FORCE = Topic(
    'sim/clamp_force',
    'geometry_msgs/msg/WrenchStamped',
    Delivery.STREAM,
    SAMPLE_RATE,
    "the friction rack's load cell in the clamp: wrench.force.z, normal force on the pads, N",
)

TOPICS: tuple[Topic, ...] = (
    DISPLACEMENT,
    COIL_RIPPLE,
    COIL_TEMPERATURE,
    ENGINE_SPEED,
    CURRENT_SETPOINT,
    AIR_GAP,
    CURRENT_FORCE_TABLE,
    CONTROL_TRACE,
    DIAGNOSTICS,
    SESSION,
    EVENT,
    SIM_TRUTH,
    SIM_CHASSIS_ACCELERATION,
    SIM_MOUNT_FORCE,
)
"""What the graph publishes and its recorder takes."""

SHADOW_TOPICS: tuple[Topic, ...] = (ELECTRONICS_TABLE, ELECTRONICS_SETPOINT)
"""The same where the electronics compute the law themselves (parameter `shadow`)."""

RACK_TOPICS: tuple[Topic, ...] = (SIM_CLAMP_FORCE,)
"""What no node publishes: only recordings of experiments on a simulated rack have it."""


def control_trace(names: Iterable[str]) -> Topic:
    """Return `CONTROL_TRACE` as a policy sends it that traces `names`, in their order."""
    scalars = tuple(Scalar(name, CONTROL_TRACE.unit(name)) for name in names)
    return replace(CONTROL_TRACE, scalars=scalars, optional=())


def topic(name: str) -> Topic:
    """Return the topic of the graph of this relative name, or raise `KeyError` with the known names."""
    known = {candidate.name: candidate for candidate in TOPICS + SHADOW_TOPICS}
    if name in known:
        return known[name]
    raise KeyError(f'{name!r} is no topic of the graph; {nearest(name, known)}')
