"""The shipped file of the diagnostic aggregator groups what the nodes publish."""

from pathlib import Path

import pytest
import yaml

import mount_bringup
from mount_bringup.graph.graph import SILENCE_LIMIT
from mount_bringup.graph.nodes import SIMULATED

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


def test_the_groups_name_the_nodes_of_the_graph_and_no_others(groups):
    named = [kind for group in groups.values() for kind in group['contains']]
    assert sorted(named) == sorted(node.name for node in SIMULATED)
    assert not [(one, other) for one in named for other in named if one != other and one in other]
