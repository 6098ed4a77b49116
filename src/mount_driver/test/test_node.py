"""The driver as a node: CAN frames on one side, topics of the real middleware on the other."""

import math
import time

import pytest
from far_end import FarEnd, sample
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from ros_testing import wait_until

from mount_driver.link import Refusal
from mount_driver.node import MountDriver
from mount_driver.protocol import Setpoint, Status
from mount_models.coil.copper import CoilHeating
from mount_models.specimen import DEFAULT_SPECIMEN
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import message_class
from mount_ros.messages.scalars import ScalarsLayout, temperature_of
from mount_ros.nodes.diagnostics import Level
from mount_ros.qos import publisher_qos
from mount_ros.topics import COIL_RIPPLE, COIL_TEMPERATURE, CURRENT_SETPOINT, DISPLACEMENT, ENGINE_SPEED

MS = 1_000_000
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


@pytest.fixture
def make_driver(make_node, multicast):
    """Return a function that creates a driver with parameters."""
    values = {'channel': multicast[0], 'port': multicast[1], 'lockstep': True}
    return lambda **parameters: make_node(MountDriver, **values | parameters)


@pytest.fixture
def far(multicast):
    end = FarEnd('udp_multicast', *multicast)
    yield end
    end.close()


class Controller:
    """Stands in for the controller: keeps what it receives, publishes setpoints."""

    def __init__(self, context):
        self.node = Node('controller', context=context)
        self.path = DataPath(self.node, lockstep=True)
        self.received = {DISPLACEMENT: [], COIL_RIPPLE: []}
        self.temperatures = []
        for topic, got in self.received.items():
            take = ScalarsLayout(topic).unpack
            self.path.subscribe(topic, lambda raw, take=take, got=got: got.append(take(raw)))
        self.path.subscribe(COIL_TEMPERATURE, lambda raw: self.temperatures.append(temperature_of(raw)))
        self.send = self.path.sender(CURRENT_SETPOINT)
        self._layout = ScalarsLayout(CURRENT_SETPOINT)
        self.path.start()

    def setpoint(self, stamp, current):
        self.send(self._layout.pack(stamp, (current,)))

    def wait_for(self, count):
        wait_until(lambda: all(len(got) >= count for got in self.received.values()), f'{count} samples')

    def close(self):
        self.path.stop()
        self.node.destroy_node()


@pytest.fixture
def controller(context):
    stand_in = Controller(context)
    yield stand_in
    stand_in.close()


@pytest.fixture
def active(make_driver, controller):
    """Return a function that creates an active driver, matched with the controller on both sides."""

    def make(**parameters):
        driver = make_driver(**parameters)
        assert driver.trigger_configure() == SUCCESS
        wait_until(lambda: not controller.path.unmatched(), 'matched by the controller')
        wait_until(lambda: not driver.data_path.unmatched(), 'matched by the driver')
        assert driver.trigger_activate() == SUCCESS
        return driver

    return make


def test_frames_become_topics_with_true_stamps_and_values(active, controller, far):
    active()
    for index in range(50):
        far.send(sample(index, coil_current=0.02 * index))
        controller.wait_for(index + 1)
    assert controller.received[DISPLACEMENT] == [(k * MS, (k / 1e6,), ()) for k in range(50)]
    for k, (stamp, (current, flux), slopes) in enumerate(controller.received[COIL_RIPPLE]):
        sent = sample(k, coil_current=0.02 * k)
        assert (stamp, current, slopes) == (k * MS, pytest.approx(0.02 * k, abs=1e-12), slopes)
        assert slopes == (sent.current_rate, sent.flux_rate)
        assert math.isnan(flux)


def test_the_coil_temperature_of_a_status_has_the_stamp_of_the_last_sample(active, controller, far):
    active()
    far.send_status(Status(14.0, 20.0))  # before any sample there is no time to give it
    for index, celsius in ((0, 61.25), (100, math.nan), (200, -12.3)):
        far.send(sample(index))
        far.send_status(Status(14.0, celsius))
        far.send_status(Status(14.0, 99.0) if index == 200 else Status(14.0, math.nan))
    wait_until(lambda: len(controller.temperatures) >= 2, 'two temperatures')
    controller.wait_for(3)
    assert controller.temperatures == [(0, 61.2), (200 * MS, -12.3)]


def test_after_a_fault_of_the_coil_an_activation_leaves_the_hole_that_makes_the_old_table_invalid(
    active, controller, far
):
    driver = active()
    for index in range(120):
        far.send(sample(index, coil_current=3.0))
        controller.wait_for(index + 1)
    wait_until(lambda: driver._exchange.link.fault, 'a fault')
    verdict = driver.judge()
    assert verdict.level == Level.ERROR
    assert verdict.sentence.startswith('coil switched off: coil current (3.000 A)')
    controller.setpoint(119 * MS, 1.0)
    wait_until(lambda: driver._exchange.link.last_refusal is Refusal.SWITCHED_OFF, 'a refusal')
    assert driver.trigger_deactivate() == SUCCESS
    ended = time.monotonic()
    assert driver.trigger_activate() == SUCCESS
    assert time.monotonic() - ended > 1.0
    assert driver._exchange.link.fault == ''


@pytest.fixture
def stranger(context):
    """Return a function that lets another node publish setpoints, and returns its publisher."""
    nodes = []

    def publish(name='evil'):
        nodes.append(Node(name, namespace='/elsewhere', context=context))
        kind = message_class(CURRENT_SETPOINT.type)
        return nodes[-1].create_publisher(kind, f'/{CURRENT_SETPOINT.name}', publisher_qos(CURRENT_SETPOINT))

    yield publish
    for node in nodes:
        node.destroy_node()


@pytest.mark.parametrize('lockstep', [True, False])
def test_another_node_that_publishes_setpoints_takes_the_coil_to_0_ampere_for_good(
    active, controller, far, stranger, lockstep
):
    driver = active(lockstep=lockstep)
    far.send(sample(0))
    controller.wait_for(1)
    stranger()
    wait_until(lambda: not far.setpoint().enable and driver._exchange.link.fault, '0 A')
    names = '/controller_io and /elsewhere/evil'
    verdict = driver.judge()
    assert (verdict.level, verdict.figures['fatal']) == (Level.ERROR, lockstep)
    assert verdict.sentence == (
        f'coil switched off: {names} must not publish current_setpoint too (limit: one writer, mount_control '
        'and mount_init): end it, then activate mount_driver, mount_init and mount_control again'
    )
    assert driver.trigger_deactivate() == SUCCESS
    assert driver.trigger_activate() == FAILURE
    assert driver.sentence.startswith(f'{names} must not publish current_setpoint too')


def test_while_a_writer_may_be_one_that_was_killed_every_answer_is_0_ampere(active, controller, far, context):
    driver = active()
    far.send(sample(0))
    controller.wait_for(1)
    controller.setpoint(0, 1.0)
    assert far.setpoint() == Setpoint(1.0, 0, True)
    twin = Node('controller_io', context=context)
    twin.create_publisher(
        message_class(CURRENT_SETPOINT.type), CURRENT_SETPOINT.name, publisher_qos(CURRENT_SETPOINT)
    )
    wait_until(
        lambda: driver._exchange.guard.writer_doubt.startswith('/controller_io must not publish'), 'the doubt'
    )
    far.send(sample(1))
    controller.wait_for(2)
    controller.setpoint(MS, 1.0)
    assert far.setpoint() == Setpoint(0.0, 1, True)
    assert driver.judge().sentence.startswith('coil at 0 A while this lasts: /controller_io must not publish')
    assert driver.judge().figures['held']
    twin.destroy_node()
    wait_until(lambda: not driver._exchange.guard.writer_doubt, 'the end of the doubt')


def test_two_senders_behind_one_publisher_are_told_by_their_answers_and_by_name_once_that_is_known(
    active, controller, far
):
    driver = active()
    for index in range(3):
        far.send(sample(index))
        controller.wait_for(index + 1)
        controller.setpoint(index * MS, 1.0)
        controller.setpoint(index * MS, 3.0)
    assert far.setpoint_where(lambda setpoint: not setpoint.enable).current == 0.0
    wait_until(lambda: driver._exchange.link.nameless, 'the fault')
    assert driver.judge().sentence.startswith('coil switched off: 3 samples within 1 s were answered twice')
    assert driver.judge().figures['fatal']
    driver.on_publisher_conflict('/evil must not publish current_setpoint too: end it', '')
    assert driver.judge().sentence.startswith('coil switched off: /evil must not publish current_setpoint')


def test_a_setpoint_message_without_the_coil_current_is_refused_and_the_path_lives_on(
    active, controller, far
):
    driver = active()
    far.send(sample(0))
    controller.wait_for(1)
    controller.send(ScalarsLayout(DISPLACEMENT).pack(0, (1.0,)))
    controller.setpoint(0, 0.5)
    assert far.setpoint().current == 0.5
    assert driver._exchange.link.counts.refused == 1


def test_a_deactivation_that_goes_wrong_before_sends_0_ampere_all_the_same(active, far, monkeypatch):
    driver = active()

    def fail():
        raise RuntimeError('the data thread is gone')

    monkeypatch.setattr(driver._path, 'remove_polls', fail)
    assert driver.trigger_deactivate() == SUCCESS
    assert [far.setpoint() for _ in range(3)] == [Setpoint(0.0, 0xFFFF, False)] * 3


def test_a_bus_that_does_not_open_fails_the_activation_and_the_node_lives_on(make_driver):
    driver = make_driver(interface='carrier_pigeon')
    assert driver.trigger_configure() == SUCCESS
    assert driver.trigger_activate() == FAILURE
    assert not driver.active
    assert 'known interfaces are' in driver.sentence
    assert driver.trigger_cleanup() == SUCCESS


def test_the_driver_takes_the_heating_of_a_specimen_file(make_driver, tmp_path):
    file = tmp_path / 'left.yaml'
    file.write_text(DEFAULT_SPECIMEN.read_text().replace('time_constant: 600.0', 'time_constant: 100.0'))
    driver = make_driver(**{'parameters_file': str(file), 'heating.ambient_celsius': 60.0})
    assert driver.trigger_configure() == SUCCESS
    assert driver._settings.heating == CoilHeating(time_constant=100.0, ambient_celsius=60.0)


def test_a_heating_that_makes_no_sense_is_refused(make_driver):
    assert make_driver(**{'heating.limit_celsius': 130.0}).trigger_configure() == FAILURE


VEHICLE = """VERSION ""
NS_ :
BS_:
BU_: Engine
BO_ 640 Engine: 8 Engine
 SG_ Speed : 0|16@1+ (0.5,0) [0|8000] "rpm" Engine
"""


@pytest.fixture
def vehicle(tmp_path):
    """Return the parameters that read the speed of the engine on the mount's own bus."""
    (tmp_path / 'vehicle.dbc').write_text(VEHICLE)
    values = {'dbc': str(tmp_path / 'vehicle.dbc'), 'message': 'Engine', 'signal': 'Speed'}
    return {f'engine_speed.{name}': value for name, value in values.items()}


def test_the_speed_of_the_engine_is_published_on_the_time_axis_of_the_displacement(
    active, controller, far, vehicle
):
    speeds = []
    layout = ScalarsLayout(ENGINE_SPEED)
    controller.path.subscribe(ENGINE_SPEED, lambda raw: speeds.append(layout.unpack(raw)))
    driver = active(lockstep=False, **vehicle)
    wait_until(lambda: driver._speed._bus is not None, 'the bus')
    before = time.time_ns()
    far.send_raw(640, bytes([1680 & 0xFF, 1680 >> 8, *bytes(6)]))
    far.send(sample(0))
    controller.wait_for(1)
    wait_until(lambda: speeds, 'the speed')
    ((stamp, (angle,), (velocity,)),) = speeds
    assert velocity == pytest.approx(28.0 * math.pi)
    assert math.isnan(angle)
    assert before - 50 * MS < stamp < time.time_ns() + 50 * MS
    assert abs(stamp - controller.received[DISPLACEMENT][0][0]) < 1000 * MS
    assert driver.trigger_deactivate() == SUCCESS
    assert driver.trigger_activate() == SUCCESS


def test_a_dbc_without_the_signal_is_refused_at_configure(make_driver, vehicle):
    driver = make_driver(**vehicle | {'engine_speed.signal': 'Sped'})
    assert driver.trigger_configure() == FAILURE
    assert driver.sentence == "engine_speed.signal: 'Sped' is no signal of Engine; did you mean Speed?"


def test_a_vehicle_bus_that_is_not_there_costs_the_mount_nothing(active, controller, far, vehicle):
    controller.path.subscribe(ENGINE_SPEED, lambda raw: None)
    driver = active(**vehicle, **{'engine_speed.interface': 'socketcan', 'engine_speed.channel': 'can7'})
    for index in range(3):
        far.send(sample(index))
        controller.wait_for(index + 1)
        controller.setpoint(index * MS, 1.0)
        assert far.setpoint() == Setpoint(1.0, index, True)
    wait_until(lambda: 'engine_speed is not read: CAN interface' in driver.judge().sentence, 'the sentence')
    assert driver.judge().level is Level.WARN
