"""The layouts for PlotJuggler and Lichtblick name signals that the topics of a drive have."""

import json
import re
from xml.etree import ElementTree

import pytest
from sources import SOURCES

from engine_mount.view.model import BESIDE
from mount_control.policy.contract import trace_fields
from mount_control.policy.registry import POLICIES
from mount_ros.topics import JOINT_STATE, TOPICS

LAYOUTS = SOURCES / 'engine_mount' / 'engine_mount' / 'view' / 'layouts'
OTHERS = {'sim/chassis_acceleration': 'linear_acceleration.z', 'sim/mount_force': 'wrench.force.z'}


def signals() -> set[tuple[str, str]]:
    """Return (topic, name of the scalar or path of the number)."""
    scalars = {
        (topic.name, scalar.name)
        for topic in (*TOPICS, BESIDE)
        if topic.type == JOINT_STATE
        for scalar in (*topic.scalars, *topic.optional)
    }
    return scalars | set(OTHERS.items())


def test_plotjuggler_s_curves_are_signals_of_a_drive():
    root = ElementTree.parse(LAYOUTS / 'plotjuggler.xml').getroot()
    names = [curve.attrib['name'] for curve in root.iter('curve')]
    known = {f'/{topic}/{name}/position' for topic, name in signals()}
    known |= {f'/{topic}/{path.replace(".", "/")}' for topic, path in OTHERS.items()}
    assert len(names) >= 10
    assert set(names) <= known


@pytest.mark.parametrize('policy', POLICIES)
def test_lichtblick_s_paths_are_the_signals_that_their_labels_name(policy):
    layout = json.loads((LAYOUTS / f'lichtblick_{policy}.json').read_text())
    order = {topic.name: topic.names for topic in (*TOPICS, BESIDE)}
    order['control_trace'] = tuple(trace_fields(POLICIES[policy]))
    drawn = 0
    for panel in layout['configById'].values():
        for path in panel['paths']:
            if re.fullmatch(r'[\d.]+', path['value']):
                continue  # a level
            topic, _, name = path['label'].partition(' ')
            assert (topic, name) in signals()
            place = f'position[{order[topic].index(name)}]' if order[topic] else name
            assert path['value'] == f'/{topic}.{place}'
            assert path['timestampMethod'] == 'headerStamp'  # Lichtblick's default is the time of reception
            drawn += 1
    assert drawn >= 10
