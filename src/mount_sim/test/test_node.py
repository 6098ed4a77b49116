"""The simulator's node: what ends its thread is told."""

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_testing import wait_until
from std_srvs.srv import SetBool

from mount_driver.can_library import can
from mount_ros.nodes.diagnostics import Level
from mount_sim.node import INJECT, MountSim

SUCCESS = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def make_sim(make_node):
    """Return a function that creates a simulator on a virtual bus, on the bench for 20 s."""
    values = {
        'interface': 'virtual',
        'channel': 'test_sim_node',
        'scenario': 'bench',
        'timeline.start': 0.0,
        'timeline.duration': 20.0,
    }
    return lambda **parameters: make_node(MountSim, **values | parameters)


@pytest.mark.parametrize('lockstep', [False, True])
@pytest.mark.parametrize(
    ('error', 'sentence'),
    [
        (RuntimeError('nobody foresaw this'), 'the run has ended: RuntimeError: nobody foresaw this'),
        (can.CanOperationError('the bus is gone'), 'the bus is gone'),
    ],
)
def test_whatever_ends_the_electronics_is_an_error_of_the_node(
    make_sim, monkeypatch, capfd, lockstep, error, sentence
):
    sim = make_sim(lockstep=lockstep)
    assert sim.trigger_configure() == SUCCESS

    def fail(name, number):
        raise error

    monkeypatch.setattr(sim, '_publish', fail)
    assert sim.trigger_activate() == SUCCESS
    wait_until(lambda: sim.judge().level is Level.ERROR, 'the error')
    assert sim.judge().sentence == sentence
    assert sim.judge().figures['fatal'] is True
    assert sim.trigger_deactivate() == SUCCESS  # the thread is over
    assert sentence in capfd.readouterr().err


@pytest.fixture
def ask(context):
    """Return a function that asks a simulator to begin faults or to end them, as a service does."""
    asker, executor = Node('asker', context=context), SingleThreadedExecutor(context=context)
    client = asker.create_client(SetBool, 'mount_sim/inject_fault')

    def ask_for(sim, begin):
        for node in (asker, sim):
            executor.add_node(node)
        wait_until(client.service_is_ready, 'the service')
        answer = client.call_async(SetBool.Request(data=begin))
        executor.spin_until_future_complete(answer, 10.0)
        for node in (asker, sim):
            executor.remove_node(node)
        return answer.result()

    yield ask_for
    executor.shutdown()
    asker.destroy_node()


def _kinds(sim):
    return [fault.name for fault in sim._mounts[''].faults.present]


def test_faults_are_told_as_a_list_of_texts_that_may_be_empty(make_sim):
    assert make_sim().get_parameter('faults').value == []
    sim = make_sim(faults=['coil_open@0', 'over_current@0:100'])
    assert sim.trigger_configure() == SUCCESS
    assert sim.trigger_activate() == SUCCESS
    wait_until(lambda: _kinds(sim) == ['coil_open', 'over_current'], 'the faults')


def test_an_unknown_fault_is_refused_when_configured(make_sim):
    sim = make_sim(faults=['fire@0'])
    assert sim.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert "fault 'fire' is unknown" in sim.sentence


def test_faults_are_begun_and_ended_by_a_service(make_sim, ask):
    sim = make_sim()
    assert sim.trigger_configure() == SUCCESS
    refused = ask(sim, begin=True)
    assert (refused.success, refused.message) == (False, 'mount_sim is not active: activate it first')
    assert sim.trigger_activate() == SUCCESS
    refused = ask(sim, begin=True)
    assert not refused.success
    assert 'inject names no fault; set it to such as' in refused.message
    (set_,) = sim.set_parameters([Parameter(INJECT, value='fire')])
    assert not set_.successful
    assert "fault 'fire' is unknown" in set_.reason
    (set_,) = sim.set_parameters([Parameter(INJECT, value='coil_open, lost_5')])
    assert set_.successful
    begun = ask(sim, begin=True)
    assert (begun.success, begun.message) == (True, 'begun: coil_open, lost_5')
    wait_until(lambda: _kinds(sim) == ['coil_open', 'lost_5'], 'the faults')
    ended = ask(sim, begin=False)
    assert (ended.success, ended.message) == (True, 'ended: coil_open, lost_5')
    wait_until(lambda: _kinds(sim) == [], 'their end')
