"""The example of a vehicle's parameter file shows every setting as the nodes declare it."""

import re

import pytest
from vehicle_file import FILE, text

from mount_bringup.graph.order import launch_order as order_of
from mount_bringup.settings import defaults_of_nodes


@pytest.fixture
def ordered(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')

    def order(file):
        return order_of(['vehicle', f'config:={file}', 'record:=false']).settings.parameters

    return order


def test_the_file_is_what_the_code_declares():
    assert FILE.read_text(encoding='utf-8') == text(), 'python test/docs/parameters_page.py renews it'


def test_every_line_may_be_set_and_gives_the_default(ordered, tmp_path):
    file = tmp_path / 'all.yaml'
    file.write_text(re.sub(r'^    # ', '    ', FILE.read_text(), flags=re.MULTILINE))
    known = defaults_of_nodes()
    given = ordered(FILE)
    for node, values in ordered(file).items():
        expected = {**known[node], **given[node]}
        expected |= {'port': values['port']} if 'port' in values else {}
        if node == 'mount_control':
            expected['damper'] = values['damper']  # spelled out
        assert repr(values) == repr({name: expected[name] for name in values})
        assert values.keys() == known[node].keys(), node
