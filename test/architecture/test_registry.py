"""The registry of topics, the nodes, docs/reference and the tables of READMEs say the same."""

import re
from functools import cache

import pytest
from sources import REPOSITORY, SOURCES

from mount_bringup.graph.nodes import SIMULATED
from mount_control.policy.contract import trace_fields
from mount_control.policy.registry import POLICIES
from mount_ros import topics
from mount_ros.qos import publisher_qos
from mount_ros.topics import (
    CONTROL_TRACE,
    DIAGNOSTICS,
    RACK_TOPICS,
    SESSION,
    SHADOW_TOPICS,
    TOPICS,
    Delivery,
)

SINCE = {'crank_frequency': 'Hz'}  # of every policy, but not in older recordings
MAY_CREATE_ENDS = {  # files that may open a publisher or a subscription themselves
    'mount_recorder/collector.py',
    'mount_ros/data_path.py',
    'mount_ros/nodes/diagnostics.py',
    'mount_bringup/graph/graph.py',
    'engine_mount/cli/bench/relay.py',  # not of the graph: bare rclpy to compare with
}


@pytest.mark.parametrize(
    ('heading', 'registry'),
    [
        ('Topics', TOPICS),
        ('Topics of the law in the electronics', SHADOW_TOPICS),
        ('Topics of the rack', RACK_TOPICS),
    ],
)
def test_interface_lists_every_topic_and_no_other(heading, registry):
    listed = {row['topic']: row for row in table(heading)}
    assert set(listed) == {topic.name for topic in registry}
    for topic in registry:
        row = listed[topic.name]
        assert row['type'] == topic.type.replace('/msg/', '/')
        assert row['delivery'] == topic.delivery.value
        assert (row['rate'] == '1 kHz') == (topic.rate == 1000.0), topic.name


def test_interface_lists_every_scalar_with_its_units_and_no_other():
    listed = [(row['topic'], row['scalar'], row['unit'], row['rate of change']) for row in table('Scalars')]
    assert listed == [
        (topic.name, scalar.name, scalar.unit, scalar.derivative_unit)
        for topic in TOPICS
        for scalar in (*topic.scalars, *topic.optional)
    ]


def test_interface_tells_the_depth_of_each_delivery():
    listed = {row['delivery']: row for row in table('Delivery')}
    assert set(listed) == {delivery.value for delivery in Delivery}
    for topic in TOPICS:
        offered, row = publisher_qos(topic), listed[topic.delivery.value]
        assert row['depth'] == str(offered.depth)
        assert row['durability'] == offered.durability.name.lower().replace('_', ' ')
        assert row['reliability'] == offered.reliability.name.lower()


def test_interface_names_publishers_and_subscribers_as_the_nodes_have_them():
    for row in table('Topics') + table('Topics of the law in the electronics'):
        name = row['topic']
        if name in (DIAGNOSTICS.name, SESSION.name):
            continue  # of every node; of the supervisor
        assert names(row['published by']) == ends_of_nodes('sender', name), f'publishers of {name}'
        assert names(row['taken by']) == ends_of_nodes('subscribe', name), f'subscribers of {name}'


@pytest.mark.parametrize('policy', POLICIES)
def test_every_policy_traces_what_the_registry_declares_and_its_own_between(policy):
    fields = trace_fields(POLICIES[policy])
    own = POLICIES[policy].TRACE
    shared = {name: unit for name, unit in fields.items() if name not in own}
    assert shared == {scalar.name: scalar.unit for scalar in CONTROL_TRACE.scalars} | SINCE
    assert list(fields)[3 : 3 + len(own)] == list(own)


def test_the_units_of_what_policies_trace_are_known_to_readers():
    units = {scalar.name: scalar.unit for scalar in CONTROL_TRACE.optional}
    assert units == SINCE | {
        name: unit for policy in POLICIES.values() for name, unit in policy.TRACE.items()
    }


def test_publishers_and_subscriptions_are_opened_by_the_registry_alone():
    opening = {
        '/'.join(file.relative_to(SOURCES).parts[1:])
        for file in SOURCES.glob('*/*mount*/**/*.py')
        if re.search(r'\.create_(publisher|subscription)\(', file.read_text())
    }
    assert opening == MAY_CREATE_ENDS


@cache
def table(heading: str) -> list[dict[str, str]]:
    """Return the first table below a heading of the page on the interface, code marks removed."""
    text = (REPOSITORY / 'docs' / 'reference' / 'interface.md').read_text()
    section = re.split(rf'^#+ {heading}$', text, flags=re.MULTILINE)[1]
    lines = re.findall(r'(?:^\|.*\|\n)+', section, flags=re.MULTILINE)[0].splitlines()
    header, *rows = [
        [cell.strip().replace('`', '') for cell in line[1:-1].split('|')]
        for line in lines
        if not line.startswith('|---')
    ]
    return [dict(zip(header, row, strict=True)) for row in rows]


def names(cell: str) -> set[str]:
    return {name for name in re.split(r', *', cell) if name}


def ends_of_nodes(kind: str, topic_name: str) -> set[str]:
    """Return the nodes that publish or take a topic on their data path; the recorder takes all."""
    found = {'mount_recorder'} if kind == 'subscribe' else set()
    for node in SIMULATED:
        source = (SOURCES / node.name / node.name / 'node.py').read_text()
        for constant in re.findall(rf'path\.{kind}\((?:topics\.)?([A-Z_]+)', source):
            if getattr(topics, constant).name == topic_name:
                found.add(node.name)
    return found
