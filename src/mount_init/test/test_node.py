"""The node between electronics that wait for each answer and a lifecycle service."""

import threading
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_testing import LIMIT, wait_until
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation

from mount_init.node import MountInit
from mount_init.parameters import InitParameters
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import message_class, temperature
from mount_ros.messages.force_table import from_bytes
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.qos import publisher_qos

STEP = 1_000_000  # ns
RAMP_LENGTH = 2750


class Electronics:
    """Simulated electronics in lock-step: each sample waits for the setpoint that answers it."""

    def __init__(self, context, plant):
        self.plant = plant
        self.setpoints = []
        self.results = []
        self.tables = []
        self.silent_after = None
        self._ripple = ScalarsLayout(topics.COIL_RIPPLE)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._air_gap = ScalarsLayout(topics.AIR_GAP)
        self.node = Node('electronics', context=context)
        self.path = DataPath(self.node, lockstep=True)
        self._publisher = self.path.publisher(topics.COIL_RIPPLE)
        self._diagnostics = self.path.publisher(topics.DIAGNOSTICS)
        self._actions = {}
        self._control_node = Node('mount_control', context=context)
        self._control = DataPath(self._control_node, lockstep=True)
        self.foreign = self._control.publisher(topics.CURRENT_SETPOINT)
        self._send_temperature = self.path.sender(topics.COIL_TEMPERATURE)
        self.path.subscribe(topics.CURRENT_SETPOINT, self._on_setpoint)
        self.path.subscribe(topics.AIR_GAP, lambda raw: self.results.append(self._air_gap.unpack(raw)))
        self.path.subscribe(topics.CURRENT_FORCE_TABLE, lambda raw: self.tables.append(from_bytes(raw)))
        self.path.start()

    @property
    def stamp(self):
        """Stamp of the newest sample; it counts from 1."""
        return (self.plant.number + 1) * STEP

    def send_sample(self):
        current, current_rate, flux_rate = self.plant.sample()
        self._publisher.publish(
            self._ripple.pack(self.stamp, (current, float('nan')), (current_rate, flux_rate))
        )

    def send_temperature(self, celsius):
        self._send_temperature(OneNumberLayout(temperature).pack(self.stamp, celsius))

    def kick(self, answered):
        """Send the next sample unless more than `answered` setpoints have come; return whether they have."""
        if len(self.setpoints) > answered:
            return True
        self.plant.follow(0.0)
        self.send_sample()
        end = time.monotonic() + 0.3
        while len(self.setpoints) <= answered and time.monotonic() < end:
            time.sleep(0.002)
        return len(self.setpoints) > answered

    def speak_as_driver(self, sentence, **figures):
        values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
        status = DiagnosticStatus(name='mount_driver', message=sentence, values=values)
        self._diagnostics.publish(DiagnosticArray(status=[status]))

    def at(self, number, action):
        """Do `action` when this many setpoints have come."""
        self._actions[number] = action

    def drive_as_another_node(self, current):
        self.foreign.publish(self._setpoint.pack(self.stamp, (current,)))

    def _on_setpoint(self, raw):
        stamp, (current,), _ = self._setpoint.unpack(raw)
        self.setpoints.append((stamp, current))
        self._actions.pop(len(self.setpoints), lambda: None)()
        if stamp != self.stamp or (self.silent_after is not None and stamp >= self.silent_after * STEP):
            return
        self.plant.follow(current)
        self.send_sample()

    def close(self):
        for path in (self.path, self._control):
            path.stop()
        self.node.destroy_node()
        self._control_node.destroy_node()


class Graph:
    """The node under test, electronics, and a client of its lifecycle, in a context of the tests."""

    def __init__(self, context, plant, parameters):
        self.context = context
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.init = MountInit(context=self.context, parameter_overrides=overrides)
        self.electronics = Electronics(self.context, plant)
        self._client_node = Node('client', context=self.context)
        self._change = self._client_node.create_client(ChangeState, '/mount_init/change_state')
        self._state = self._client_node.create_client(GetState, '/mount_init/get_state')
        self._ending = threading.Event()
        self._threads = [
            threading.Thread(target=self._spin, args=(node,)) for node in (self.init, self._client_node)
        ]
        for thread in self._threads:
            thread.start()

    def configure(self):
        assert self.change(Transition.TRANSITION_CONFIGURE)
        node = self.init.data_path.node
        path = self.electronics.path.node
        wait_until(
            lambda: (
                node.count_publishers('coil_ripple') == 1
                and path.count_subscribers('coil_ripple') == 1
                and path.count_publishers('current_setpoint') == 2
                and node.count_publishers('current_setpoint') == 2
                and node.count_subscribers('current_setpoint') == 2
                and self.electronics._publisher.get_subscription_count() == 1
                and node.count_subscribers('air_gap') == 1
                and not any(
                    'coil_temperature' in name
                    for end in (self.init.data_path, self.electronics.path)
                    for name in end.unmatched()
                )
            ),
            'the connection of both sides',
        )

    def change(self, transition):
        """Ask the lifecycle service for a transition; return whether it succeeded."""
        assert self._change.wait_for_service(LIMIT)
        request = ChangeState.Request(transition=Transition(id=transition))
        return self._result(self._change.call_async(request)).success

    def state(self):
        return self._result(self._state.call_async(GetState.Request())).current_state.id

    def refusal(self):
        return self.init._refusal

    def close(self):
        self._ending.set()
        for thread in self._threads:
            thread.join()
        self.init.close()
        self.electronics.close()
        self.init.destroy_node()
        self._client_node.destroy_node()

    def _result(self, future):
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        assert done.wait(LIMIT), 'the lifecycle service did not answer'
        return future.result()

    def _spin(self, node):
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(node)
        while not self._ending.is_set():
            executor.spin_once(0.05)
        executor.remove_node(node)
        executor.shutdown()


@pytest.fixture
def graph(context):
    """Return a function that builds the graph; by default in lock-step around a fault-free actuator."""
    made = []
    SimulatedActuator().follow(0.0)  # compiled before the node waits for its samples

    def make(plant=None, **parameters):
        made.append(Graph(context, plant or SimulatedActuator(), {'lockstep': True, **parameters}))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_activation_measures_in_lock_step_and_latches_gaps_and_table(graph):
    g = graph(coil_temperature_celsius=90.0)
    g.configure()
    g.electronics.send_temperature(45.0)  # what is measured comes first
    g.electronics.send_sample()
    assert g.change(Transition.TRANSITION_ACTIVATE)
    wait_until(lambda: g.electronics.tables and g.electronics.results, 'the table and the gaps')

    stamps = [stamp // STEP for stamp, _ in g.electronics.setpoints]
    assert stamps == list(range(1, RAMP_LENGTH + 1))
    wait_until(lambda: g.electronics.setpoints[-1][1] == 0.0, '0 A')

    core = run_initialisation(SimulatedActuator(), SPECIMEN, InitParameters(coil_temperature_celsius=45.0))
    stamp, numbers, _ = g.electronics.results[0]
    assert stamp == RAMP_LENGTH * STEP
    # the same samples as plain function calls: the same result to the bit
    assert numbers == (
        core.rest_gap,
        core.contact_gap,
        core.rest_gap_std,
        core.contact_gap_std,
        core.contact_force,
        core.offset_current,
    )
    table = g.electronics.tables[0]
    assert table.stamp == stamp
    assert (table.current == core.table[0]).all()
    assert (table.normal_force == core.table[1]).all()
    verdict = g.init.judge()
    assert verdict.sentence.startswith(f'rest gap {core.rest_gap * 1e6:.1f} um, contact gap ')
    assert verdict.figures['coil_temperature_from'] == 'measured'
    assert verdict.figures['last_stamp'] == stamp


def test_after_the_ramp_the_node_leaves_the_coil_to_others(graph):
    g = graph()
    g.configure()
    g.electronics.send_sample()
    assert g.change(Transition.TRANSITION_ACTIVATE)
    wait_until(lambda: g.electronics.stamp == (RAMP_LENGTH + 1) * STEP, 'the end of the ramp')
    for _ in range(20):
        before = g.electronics.stamp
        g.electronics.drive_as_another_node(0.5)
        wait_until(lambda before=before: g.electronics.stamp > before, 'the next sample')
    # mount_init is deactivated while another node drives: it must not interfere
    assert g.change(Transition.TRANSITION_DEACTIVATE)
    assert g.state() == State.PRIMARY_STATE_INACTIVE
    assert [current for _, current in g.electronics.setpoints[RAMP_LENGTH:]] == [0.5] * 20


def test_a_second_activation_measures_anew(graph):
    g = graph()
    g.configure()
    g.electronics.send_sample()
    assert g.change(Transition.TRANSITION_ACTIVATE)
    wait_until(lambda: len(g.electronics.tables) == 1, 'the first table')
    assert g.change(Transition.TRANSITION_DEACTIVATE)
    number = g.electronics.plant.number
    worn = SimulatedActuator(contact_gap=330e-6)
    worn.number = number
    g.electronics.plant = worn
    assert g.change(Transition.TRANSITION_ACTIVATE)
    wait_until(
        lambda: len(g.electronics.results) == 2 and len(g.electronics.tables) == 2, 'the second activation'
    )
    assert g.electronics.results[1][1][1] == pytest.approx(330e-6, abs=0.2e-6)
    assert g.electronics.results[1][0] == 2 * RAMP_LENGTH * STEP
    assert g.electronics.tables[1].stamp == 2 * RAMP_LENGTH * STEP
    stamps = [stamp // STEP for stamp, _ in g.electronics.setpoints]
    assert stamps == list(range(1, 2 * RAMP_LENGTH + 1))


def test_in_real_time_the_node_hears_the_streams_only_while_it_measures(graph):
    g = graph(lockstep=False)
    g.configure()
    subscribers = g.electronics.path.node.count_subscribers
    for turn in range(2):
        # Nobody waits for these electronics: they send until they are answered.
        activating = threading.Thread(target=g.change, args=(Transition.TRANSITION_ACTIVATE,))
        activating.start()
        answered = len(g.electronics.setpoints)
        wait_until(lambda answered=answered: g.electronics.kick(answered), 'the first answer')
        activating.join()
        assert g.state() == State.PRIMARY_STATE_ACTIVE
        wait_until(lambda turn=turn: len(g.electronics.tables) == turn + 1, 'the table')
        wait_until(
            lambda: (subscribers('coil_ripple'), subscribers('current_setpoint')) == (0, 1),
            'the end of listening of all but the electronics',
        )
        assert subscribers('coil_temperature') == 1
        assert g.change(Transition.TRANSITION_DEACTIVATE)


def test_a_refused_estimate_leaves_no_result_and_zero_current(graph):
    g = graph(SimulatedActuator(contact_gap=230e-6))
    g.configure()
    g.electronics.send_sample()
    assert not g.change(Transition.TRANSITION_ACTIVATE)
    assert g.state() == State.PRIMARY_STATE_INACTIVE
    assert 'contact gap not estimated' in g.refusal()
    wait_until(lambda: len(g.electronics.setpoints) == RAMP_LENGTH, 'the end of the ramp')
    wait_until(lambda: g.electronics.setpoints[-1][1] == 0.0, '0 A')
    assert (g.electronics.results, g.electronics.tables) == ([], [])


def test_while_another_node_drives_the_coil_activation_is_refused(graph):
    g = graph()
    g.configure()
    g.electronics.send_sample()
    stop = threading.Event()

    def drive():
        while not stop.wait(0.01):
            g.electronics.drive_as_another_node(0.5)

    other = threading.Thread(target=drive)
    other.start()
    try:
        wait_until(lambda: len(g.electronics.setpoints) > 5, 'the begin of the ramp')
        assert not g.change(Transition.TRANSITION_ACTIVATE)
    finally:
        stop.set()
        other.join()
    assert 'another node sent a current_setpoint' in g.refusal()
    assert 'deactivate mount_control first' in g.refusal()
    assert {current for _, current in g.electronics.setpoints} == {0.5}


def test_what_the_driver_refuses_is_refused_with_its_reason(graph):
    g = graph(SimulatedActuator(distort=lambda _, s: (0.0, s[1], s[2])))
    g.configure()
    g.electronics.send_sample()

    def heard():
        g.electronics.speak_as_driver('cable is open', held=True)
        return g.init._driver.refusal(g.init.ending)

    wait_until(heard, 'the verdict of the driver')
    assert not g.change(Transition.TRANSITION_ACTIVATE)
    assert g.refusal() == 'mount_driver keeps the coil at 0 A: cable is open'
    wait_until(lambda: g.electronics.setpoints[-1][1] == 0.0, '0 A')


def test_another_node_that_publishes_the_ripple_ends_the_ramp(graph, context):
    g = graph()
    g.electronics.silent_after = 1000
    g.configure()
    g.electronics.send_sample()
    others = []

    def publish():
        others.append(Node('evil', namespace='/elsewhere', context=context))
        kind = message_class(topics.COIL_RIPPLE.type)
        others[0].create_publisher(kind, '/coil_ripple', publisher_qos(topics.COIL_RIPPLE))

    g.electronics.at(500, publish)
    assert not g.change(Transition.TRANSITION_ACTIVATE)
    assert g.refusal().startswith('/electronics_io and /elsewhere/evil must not publish coil_ripple too')
    wait_until(lambda: g.electronics.setpoints[-1][1] == 0.0, '0 A')
    assert not g.change(Transition.TRANSITION_ACTIVATE)
    others[0].destroy_node()


@pytest.mark.parametrize(
    ('parameters', 'sentence'),
    [
        (
            {'parameters_file': '/nowhere/specimen.yaml'},
            'specimen file /nowhere/specimen.yaml cannot be read',
        ),
        ({'settle_duration': 0.4}, 'settle_duration (0.4 s) must lie below dwell_duration (0.3 s)'),
    ],
)
def test_a_specimen_or_parameters_that_cannot_be_used_are_refused_at_configure(graph, parameters, sentence):
    g = graph(**parameters)
    assert not g.change(Transition.TRANSITION_CONFIGURE)
    assert g.state() == State.PRIMARY_STATE_UNCONFIGURED
    assert sentence in g.refusal()
