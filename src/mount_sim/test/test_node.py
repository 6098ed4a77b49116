"""The simulator's node: what ends its thread is told."""

import can
import pytest
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter

from mount_ros.nodes.diagnostics import Level
from mount_ros.testing import wait_until
from mount_sim.node import MountSim

SUCCESS = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def make_sim(context):
    """Return a function that creates a simulator on a virtual bus, on the bench for 20 s."""
    made = []

    def make(**parameters):
        values = {
            'interface': 'virtual',
            'channel': 'test_sim_node',
            'scenario': 'bench',
            'timeline.start': 0.0,
            'timeline.duration': 20.0,
            **{name.replace('__', '.'): value for name, value in parameters.items()},
        }
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        made.append(MountSim(context=context, parameter_overrides=overrides))
        return made[-1]

    yield make
    for node in made:
        node.close()
        node.destroy_node()
    del node
    made.clear()


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
