"""A process that records four streams at 1 kHz until it is killed, without middleware.

Arguments: the recording's folder, and a file of 8 bytes in which it tells how many samples it took.
"""

import mmap
import random
import sys
import time

from mount_recorder.bag_writer import BagWriter
from mount_recorder.recorder import Recorder
from mount_recorder.split import SplitRule

TOPICS = ('/one', '/two', '/three', '/four')
JOINT_STATE = 'sensor_msgs/msg/JointState'
STRING = 'std_msgs/msg/String'
SPLIT = SplitRule(duration=250_000_000)


def main(folder, progress_file):
    with open(progress_file, 'r+b') as file:
        progress = mmap.mmap(file.fileno(), 8)
    writer = BagWriter(folder, split=SPLIT)
    writer.add_topic('/session', STRING, latched=True)
    for topic in TOPICS:
        writer.add_topic(topic, JOINT_STATE)
    recorder = Recorder(writer)
    session, receivers = recorder.latched_receiver('/session'), [recorder.receiver(name) for name in TOPICS]
    session(b'\0\1\0\0\2\0\0\0s\0', time.time_ns(), time.time_ns())
    recorder.begin()
    noise = random.Random(1)
    index = 0
    while True:
        now = time.time_ns()
        raw = b'\0\1\0\0' + index.to_bytes(8, 'little') + noise.randbytes(80)
        for receive in receivers:
            receive(raw, now, now)
        index += 1
        progress[:] = index.to_bytes(8, 'little')
        # No catching up: a machine that lets this process wait makes fewer samples, not more at once.
        time.sleep(1e-3)


if __name__ == '__main__':
    main(*sys.argv[1:])
