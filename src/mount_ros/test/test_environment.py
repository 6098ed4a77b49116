"""What a process needs of its machine before the middleware starts."""

from mount_ros.environment import loopback_refusal


def test_a_loopback_interface_that_is_down_is_told_with_the_remedy(monkeypatch):
    assert loopback_refusal() == ''
    monkeypatch.setattr('mount_ros.environment._NEIGHBOUR', ('255.255.255.255', 9))  # refused without a flag
    assert loopback_refusal().startswith('the loopback interface is down (')
    assert loopback_refusal().endswith('): `ip link set lo up`')
