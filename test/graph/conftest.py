"""What the tests of the whole graph share: drives without an end, and what was seen on their bus."""

import threading

import pytest

from mount_bringup.graph.domain import can_port
from mount_driver.bus import MULTICAST_GROUP, open_bus
from mount_driver.protocol import MountCodec


@pytest.fixture
def endless_drive(command):
    """Return the function that starts a drive without an end: the process, and its folder.

    One process for each node and in real time, as in the car.
    """
    options = ('--scenario', 'bench', '--duration', '600', '--set', 'mount_sim.timeline.start=2.9')
    return lambda: command.start_drive('--priority', '0', '--restarts', '0', *options)


@pytest.fixture
def bus_listener(domain):
    """The setpoints seen on the CAN bus, by a peer that was there all the time."""
    codec = MountCodec()
    setpoints = []
    bus = open_bus(
        'udp_multicast',
        MULTICAST_GROUP,
        port=can_port(domain, ''),
        receive=[codec.setpoint.frame_id],
    )
    ending = threading.Event()

    def listen():
        while not ending.is_set():
            frame = bus.recv(0.1)
            if frame is not None:
                setpoints.append(codec.setpoint.decode(frame.data)[1])

    thread = threading.Thread(target=listen)
    thread.start()
    yield setpoints
    ending.set()
    thread.join()
    bus.shutdown()
