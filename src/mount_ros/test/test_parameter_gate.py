"""What may be set on a node when, and what the node hears of it."""

import pytest
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter

from mount_ros.data_path import io_node
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import Change


class Subject(SafeLifecycleNode):
    """Two levels that may be set at run time, the lower below the upper, and a name that may not."""

    run_time_parameters = frozenset({'lower', 'upper'})

    def __init__(self, **arguments):
        super().__init__('subject', **arguments)
        self.declare_parameter('lower', 1.0)
        self.declare_parameter('upper', 2.0)
        self.declare_parameter('name', 'first')
        self.taken = []

    def check_parameters(self, values):
        if not values['lower'] < values['upper']:
            raise ValueError(f'lower ({values["lower"]:g}) must lie below upper ({values["upper"]:g})')

    def apply_changes(self, changes):
        self.taken.append((changes, self.get_parameter('lower').value))


@pytest.fixture
def subject(make_node):
    return make_node(Subject)


def _set(node, **values):
    return node.set_parameters([Parameter(name, value=value) for name, value in values.items()])


@pytest.mark.parametrize('activated', [False, True])
def test_once_configured_run_time_parameters_are_checked_set_and_told(subject, activated):
    subject.trigger_configure()
    if activated:
        subject.trigger_activate()
    assert _set(subject, lower=1.5)[0].successful
    assert subject.taken == [({'lower': Change(1.0, 1.5)}, 1.5)]
    (refused,) = _set(subject, upper=1.2)
    assert (refused.successful, refused.reason) == (False, 'lower (1.5) must lie below upper (1.2)')
    assert subject.get_parameter('upper').value == 2.0
    # the present value is what was set last, and to set it again is no change
    assert _set(subject, lower=1.5)[0].successful
    assert _set(subject, lower=1.6)[0].successful
    assert subject.taken[1:] == [({'lower': Change(1.5, 1.6)}, 1.6)]


@pytest.mark.parametrize(('name', 'value'), [('name', 'second'), ('lockstep', True)])
def test_all_others_are_refused_until_cleanup(subject, name, value):
    subject.trigger_configure()
    (refused,) = _set(subject, **{name: value})
    assert not refused.successful
    assert refused.reason == (
        f'{name} can be set before configure: deactivate and clean up first; '
        'what can be set at run time is lower, upper'
    )
    subject.trigger_cleanup()
    assert _set(subject, **{name: value})[0].successful
    assert subject.taken == []


def test_the_time_of_a_simulator_has_no_effect_at_the_start_and_is_refused_later(make_node, capfd):
    subject = make_node(Subject, use_sim_time=True)
    assert 'use_sim_time stays false' in capfd.readouterr().err
    assert subject.trigger_configure() is TransitionCallbackReturn.SUCCESS
    assert not subject.get_parameter('use_sim_time').value
    (refused,) = _set(subject, use_sim_time=True)
    assert not refused.successful
    assert refused.reason.startswith('use_sim_time stays false: the stamps of the messages are the time')
    assert '/clock' not in dict(subject.get_topic_names_and_types())


def test_the_node_of_the_data_takes_no_clock_where_all_nodes_are_given_one(domain):
    context = rclpy.Context()
    rclpy.init(args=['--ros-args', '-p', 'use_sim_time:=true'], context=context, domain_id=domain)
    owner = Node('owner', context=context)
    found = [node.get_parameter('use_sim_time').value for node in (owner, io_node(owner))]
    context.try_shutdown()
    assert found == [True, False]
