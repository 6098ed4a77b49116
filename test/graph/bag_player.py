"""Publishes a recording as `ros2 bag play` does, for tests where rosbag2 is not installed.

As rosbag2: by the wall clock from one receive time to the next, the serialised messages as they are, each
topic with the quality of service of the file of overrides, else with that which metadata.yaml has, from the
node `rosbag2_player`.
The test starts it under the name `ros2`, so arguments are those of `ros2 bag play`.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import rclpy
import yaml
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from engine_mount.recordings.recording import open_recording
from mount_ros.messages.cdr import message_class

DEPTH = 1000  # rosbag2 takes the default of the middleware where discovery told none


def play(bag, topics, rate, delay, overrides):
    """Publish `topics` of `bag` and return when the last message has left."""
    recording = open_recording(bag)
    node = Node('rosbag2_player')
    publishers = [
        node.create_publisher(
            message_class(recording.topics[name].type), name, offered(recording, name, overrides)
        )
        for name in topics
    ]
    times = np.concatenate([recording[name].receive_times for name in topics])
    owner = np.repeat(np.arange(len(topics)), [len(recording[name]) for name in topics])
    payloads = [payload for name in topics for payload in recording[name].payloads]
    order = np.argsort(times, kind='stable')
    begin = time.monotonic() + delay
    for place in order:
        due = begin + 1e-9 * (times[place] - times[order[0]]) / rate
        time.sleep(max(0.0, due - time.monotonic()))
        publishers[owner[place]].publish(bytes(payloads[place]))
    for publisher in publishers:
        publisher.wait_for_all_acked()
    node.destroy_node()


def offered(recording, name, overrides):
    offer = overrides.get(name) or next(map(vars, recording.topics[name].offered_qos), {})
    return QoSProfile(
        depth=DEPTH,
        reliability=ReliabilityPolicy[offer.get('reliability', 'reliable').upper()],
        durability=DurabilityPolicy[offer.get('durability', 'volatile').upper()],
    )


def main():
    parser = argparse.ArgumentParser(prog='ros2')
    parser.add_argument('bag', choices=['bag'])
    parser.add_argument('play', choices=['play'])
    parser.add_argument('folder', type=Path)
    parser.add_argument('--rate', type=float, default=1.0)
    parser.add_argument('--delay', type=float, default=0.0)
    parser.add_argument('--disable-keyboard-controls', action='store_true')
    parser.add_argument('--qos-profile-overrides-path', type=Path)
    parser.add_argument('--topics', nargs='+')
    chosen = parser.parse_args()
    overrides = chosen.qos_profile_overrides_path
    rclpy.init()
    play(
        chosen.folder,
        chosen.topics,
        chosen.rate,
        chosen.delay,
        yaml.safe_load(overrides.read_text()) if overrides else {},
    )
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
