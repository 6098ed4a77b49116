"""A second node that publishes what only one may: the coil goes to 0 A, and the reason is told."""

import os
import signal
import subprocess
import sys
import threading

import pytest
from ros_testing import wait_until

import engine_mount
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import losses
from mount_ros.environment import prepare_environment

LIMIT = 120.0  # s: other tests run at the same time, only a failure takes so long

# Answers each sample with 3 A, its stamp sound; or sends each displacement once more half a sample later.
STRANGER = """
import sys
import rclpy
from rclpy.node import Node
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.messages.cdr import message_class
from mount_ros.qos import control_qos, publisher_qos
from mount_ros.topics import DISPLACEMENT, topic

rclpy.init()
node = Node('evil', namespace='/elsewhere')
sent, heard = topic(sys.argv[1]), ScalarsLayout(DISPLACEMENT)
layout = ScalarsLayout(sent)
late, number = {'current_setpoint': (0, 3.0), 'displacement': (500_000, 0.003)}[sent.name]
publish = node.create_publisher(message_class(sent.type), f'/{sent.name}', publisher_qos(sent)).publish
take = lambda raw: publish(layout.pack(heard.unpack(raw)[0] + late, (number,)))
kind, qos = message_class(DISPLACEMENT.type), control_qos(DISPLACEMENT, lockstep=False)
node.create_subscription(kind, '/displacement', take, qos, raw=True)
rclpy.spin(node)
"""

pytestmark = pytest.mark.real_time  # each drive has a process for each node


@pytest.mark.parametrize(
    ('topic', 'sentence'),
    [
        ('current_setpoint', 'coil switched off: /elsewhere/evil must not publish current_setpoint too'),
        pytest.param(
            'displacement', '0 A: /elsewhere/evil must not publish displacement too', marks=pytest.mark.slow
        ),
    ],
)
def test_a_second_node_switches_the_coil_off_until_the_mount_is_initialised_again(
    endless_drive, command, bus_listener, topic, sentence
):
    prepare_environment()
    process, out = endless_drive()
    said = []
    reading = threading.Thread(target=lambda: said.append(process.communicate()[0]))
    reading.start()
    wait_until(lambda: any(setpoint.current > 0.6 for setpoint in bus_listener[3500:]), 'damping', LIMIT)
    stranger = subprocess.Popen(
        [sys.executable, '-c', STRANGER, topic], env={**os.environ, 'ROS_DOMAIN_ID': str(command.domain)}
    )
    try:
        wait_until(lambda: _at_rest(bus_listener[-100:]), '0 A on the bus', LIMIT)
        off = len(bus_listener)
        wait_until(lambda: len(bus_listener) > off + 100, '100 further setpoints', LIMIT)
    finally:
        stranger.kill()
        stranger.wait()
    gone = len(bus_listener)
    wait_until(lambda: len(bus_listener) > gone + 100, '100 setpoints after the stranger', LIMIT)
    process.send_signal(signal.SIGINT)
    reading.join(LIMIT)
    assert not reading.is_alive(), 'the drive goes on'
    assert _at_rest(bus_listener[off:])
    assert process.returncode == 130, said[0]
    assert sentence in ' '.join(said[0].split())
    recording = engine_mount.open(out / 'recording')
    told = losses(recording, audit(recording))
    assert not told.sound
    assert any(sentence in fault.sentence for fault in told.faults)


def _at_rest(setpoints):
    """Whether every one of these setpoints is 0 A."""
    return bool(setpoints) and all(setpoint.current == 0.0 for setpoint in setpoints)
