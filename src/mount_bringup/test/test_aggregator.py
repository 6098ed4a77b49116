"""The shipped file of the diagnostic aggregator groups what the nodes publish."""

from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from rclpy.node import Node

import mount_bringup
from mount_bringup.graph.nodes import SIMULATED
from mount_bringup.graph.reports import SILENCE_LIMIT
from mount_ros.nodes.diagnostics import Diagnostics, Level, Verdict

FILE = Path(mount_bringup.__file__).parents[1] / 'config' / 'diagnostic_aggregator.yaml'


@pytest.fixture
def groups():
    [content] = yaml.safe_load(FILE.read_text()).values()
    values = content['ros__parameters']
    assert isinstance(values.pop('path'), str)
    return values


def members(groups, name):
    """Return the groups that take a status, by the rule `contains` of the aggregator."""
    return [group for group, values in groups.items() if any(part in name for part in values['contains'])]


def test_a_group_has_what_its_analyzer_needs_in_the_types_that_it_reads(groups):
    for values in groups.values():
        assert {name: type(value) for name, value in values.items()} == {
            'type': str, 'path': str, 'contains': list, 'timeout': float,
        }  # fmt: skip
        assert values['timeout'] == SILENCE_LIMIT


def test_the_groups_name_the_nodes_of_the_graph_and_no_others(groups):
    named = [kind for group in groups.values() for kind in group['contains']]
    assert sorted(named) == sorted(node.name for node in SIMULATED)


@pytest.mark.parametrize('namespace', ['', 'mount_right', 'car/left'])
def test_every_status_that_a_node_publishes_belongs_to_one_group(groups, context, namespace):
    for graph_node in SIMULATED:
        node, told = Node(graph_node.name, namespace=namespace, context=context), []
        diagnostics = Diagnostics(node, lambda: Verdict(Level.OK, 'well'))
        diagnostics._publisher = SimpleNamespace(publish=told.append)
        diagnostics.publish(Verdict(Level.OK, 'well'))
        node.destroy_node()
        [message] = told
        [status] = message.status
        assert len(members(groups, status.name)) == 1, status.name
