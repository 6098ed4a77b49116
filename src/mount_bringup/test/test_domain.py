"""One graph and one simulated CAN bus for each ROS domain and namespace."""

import os

import pytest

from mount_bringup.graph import domain
from mount_bringup.graph.domain import can_port, domain_lock
from mount_models.quantity import ParameterError


@pytest.fixture(autouse=True)
def own_places(monkeypatch):
    monkeypatch.setattr(domain, '_PLACE', f'\0engine_mount_test_{os.getpid()}')


def test_each_domain_and_namespace_has_a_port_of_its_own_where_nobody_else_is_given_one():
    places = [(number, name) for number in range(101) for name in ('', 'left')]
    ports = [can_port(*place) for place in places]
    assert len(set(ports)) == len(places)
    assert max(ports) < 32768  # above, Linux gives ports to whoever asks for any
    assert min((port - 7400) % 250 for port in ports) >= 130  # below are the participants of the domain
    assert can_port(1, '/left/') == can_port(1, 'left')
    assert can_port(1, '/') == can_port(1, '')


def test_a_second_graph_in_a_namespace_is_refused_until_the_first_has_ended():
    with (
        domain_lock(3, 'left'),
        domain_lock(3, 'right'),
        domain_lock(4, 'left'),
        pytest.raises(ParameterError, match='already runs in ROS domain 3, namespace /left'),
    ):
        domain_lock(3, '/left').__enter__()
    with domain_lock(3, 'left'):
        pass


def test_namespaces_that_would_share_a_can_bus_do_not_run_at_the_same_time(monkeypatch):
    monkeypatch.setattr(domain, '_PLACES', 1)
    with (
        domain_lock(3, 'left'),
        pytest.raises(ParameterError, match='namespace /right, or in one whose CAN bus would have port 8281'),
    ):
        domain_lock(3, 'right').__enter__()
