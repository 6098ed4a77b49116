"""The shipped file of the diagnostic aggregator groups what the nodes publish."""

import importlib
from functools import partial
from pathlib import Path

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from ros_testing import wait_until

import mount_bringup
from mount_bringup.graph.graph import SILENCE_LIMIT
from mount_bringup.graph.nodes import SIMULATED
from mount_ros.messages.cdr import deserialise
from mount_ros.private_rclpy import raw_taker
from mount_ros.topics import DIAGNOSTICS

FILE = Path(mount_bringup.__file__).parents[1] / 'config' / 'diagnostic_aggregator.yaml'


@pytest.fixture
def groups():
    [content] = yaml.safe_load(FILE.read_text()).values()
    values = content['ros__parameters']
    assert isinstance(values.pop('path'), str)
    return values


def test_a_group_has_what_its_analyzer_needs_in_the_types_that_it_reads(groups):
    for values in groups.values():
        assert {name: type(value) for name, value in values.items()} == {
            'type': str, 'path': str, 'contains': list, 'timeout': float,
        }  # fmt: skip
        assert values['timeout'] == SILENCE_LIMIT


@pytest.mark.parametrize('namespace', ['', 'mount_right'])
def test_each_status_that_a_node_publishes_is_in_one_group(groups, make_node, namespace):
    listener = make_node(partial(Node, 'listener'))
    take = raw_taker(listener.create_subscription(DiagnosticArray, DIAGNOSTICS.name, print, 100, raw=True))
    names = set()

    def each_has_published():
        while taken := take():
            names.update(status.name for status in deserialise(taken[0], DIAGNOSTICS.type).status)
        return len(names) == len(SIMULATED)

    for node in SIMULATED:
        kind = getattr(importlib.import_module(f'{node.name}.node'), node.class_name)
        make_node(partial(kind, namespace=namespace))
    wait_until(each_has_published, 'a status of each node')
    words = [group['contains'] for group in groups.values()]
    for name in names:  # as GenericAnalyzer: a part of the name
        assert sum(any(word in name for word in group) for group in words) == 1
    assert all(any(word in name for name in names) for group in words for word in group)
