"""Plugin of pytest: tests of the other buses open the interface `vcan0` of SocketCAN instead."""

from collections.abc import Sequence

from mount_driver import bus
from mount_driver.can_library import can

CHANNEL = 'vcan0'
UNCHANGED = 'unchanged'
"""The channel of a virtual bus that stays one."""
_open_bus = bus.open_bus


def _open_instead(interface: str, channel: str, *, receive: Sequence[int] = (), port: int = 0) -> can.BusABC:
    if interface in ('virtual', 'udp_multicast') and channel != UNCHANGED:
        interface, channel = 'socketcan', CHANNEL
    return _open_bus(interface, channel, receive=receive, port=port)


bus.open_bus = _open_instead
