"""A second node that publishes what only one may: the coil goes to 0 A, and the reason is told."""

import os
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
def test_a_second_node_ends_the_drive_at_0_ampere_with_its_name(
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
        reading.join(LIMIT)
        assert not reading.is_alive(), 'the drive goes on'
    finally:
        stranger.kill()
        stranger.wait()
    assert process.returncode == 1, said[0]
    assert sentence in said[0]
    assert bus_listener[-1].current == 0.0
    recording = engine_mount.open(out / 'recording')
    told = losses(recording, audit(recording))
    assert not told.sound
    assert any(sentence in fault.sentence for fault in told.faults)
