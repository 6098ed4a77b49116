"""A process that records four streams at 1 kHz until it is killed, without middleware.

Arguments: the recording's folder, and a file of 8 bytes into which it writes how many samples it took.
"""

import mmap
import random
import sys
import time
from functools import partial
from pathlib import Path

from mount_recorder.bag_writer import BagWriter
from mount_recorder.recorder import Recorder

TOPICS = ('/one', '/two', '/three', '/four')
SPLIT = 200_000  # bytes


def main(folder, progress_file):
    with open(progress_file, 'r+b') as file:
        progress = mmap.mmap(file.fileno(), 8)
    recorder = Recorder(Path(folder), open_writer=partial(BagWriter, split_size=SPLIT))
    session = recorder.add_topic('/session', 'std_msgs/msg/String', latched=True)
    receivers = [recorder.add_topic(topic, 'sensor_msgs/msg/JointState') for topic in TOPICS]
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
