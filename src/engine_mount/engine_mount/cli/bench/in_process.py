"""What one call costs, without middleware, beside its alternative or beside real time."""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from engine_mount.cli.bench.comparison import Comparison, in_turn
from engine_mount.drives.loop.run import run_core
from engine_mount.drives.replay import replay as replay_recording
from engine_mount.settings.chosen import chosen_control
from mount_control.controller import ControlLaw, Controller
from mount_control.force_maker import resample
from mount_driver.can_library import cantools
from mount_driver.protocol import DATABASE_FILE, Measurement, MountCodec
from mount_models.sampling import SAMPLE_TIME
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CONTROL_TRACE, TOPICS

_ROUNDS = 7
_REPEATS = 2000
_DRIVEN = 20.0  # s
_STAMP = 1_700_000_000_000_000_000


def packing() -> Comparison:
    """Pack one message, against the general serialisation."""
    layout, numbers = ScalarsLayout(CONTROL_TRACE), tuple(float(n) for n in range(len(CONTROL_TRACE.names)))

    def general() -> bytes:
        return serialize_message(JointState(name=list(CONTROL_TRACE.names), position=list(numbers)))

    ours, other = in_turn(lambda: layout.pack(_STAMP, numbers), general, _ROUNDS, _REPEATS)
    return Comparison('pack a control_trace', ours, 'rclpy message', other)


def unpacking() -> Comparison:
    """Unpack one message, likewise."""
    layout = ScalarsLayout(CONTROL_TRACE)
    raw = layout.pack(_STAMP, tuple(float(n) for n in range(len(CONTROL_TRACE.names))))
    ours, other = in_turn(
        lambda: layout.unpack(raw), lambda: deserialize_message(raw, JointState), _ROUNDS, _REPEATS
    )
    return Comparison('unpack a control_trace', ours, 'rclpy message', other)


def coding() -> Comparison:
    """Decode one CAN frame and check it, against cantools, which does not check."""
    codec = MountCodec()
    database = cantools.database.load_file(DATABASE_FILE)
    assert isinstance(database, cantools.database.can.Database)
    message = database.get_message_by_name('MountMeasurement')
    frame = codec.encode_measurement(Measurement(7, 7000, 1e-4, 0.2, 300.0, 110.0), 7)
    ours, other = in_turn(
        lambda: codec.decode_measurement(frame), lambda: message.decode(frame), _ROUNDS, _REPEATS
    )
    return Comparison('decode one CAN frame with CRC', ours, 'cantools, no CRC', other)


def control() -> Comparison:
    """Take one step of the controller."""
    table = resample(np.array([0.4, 3.0]), np.array([0.0, 300.0]), 0.5, 3.0)
    controller = Controller(ControlLaw(chosen_control({}), table))
    displacement = 1e-3 * np.sin(2.0 * np.pi * 8.0 * np.arange(60_000) * SAMPLE_TIME)
    ours = _median_time(lambda: controller.run(displacement)) / len(displacement)
    return Comparison('one control step', ours, 'real time', SAMPLE_TIME)


def closed_loop() -> Comparison:
    """A whole run: initialisation, excitation, every message packed but not stored."""
    order = {'mount_sim': {'scenario': 'bench', 'timeline.duration': _DRIVEN}}

    def run() -> int:
        return run_core(order, lambda *_: None, write_columns=lambda *_: None).samples

    samples = run()
    return Comparison('one sample, plant and control', _median_time(run) / samples, 'real time', SAMPLE_TIME)


def replay() -> Comparison:
    """A recorded drive: from the displacement in memory to the last setpoint."""
    order = {'mount_sim': {'scenario': 'bench', 'timeline.duration': _DRIVEN}}
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / 'recording'
        writer = BagWriter(recording)
        names = {topic.name: f'/{topic.name.lstrip("/")}' for topic in TOPICS}
        for topic in TOPICS:
            writer.add_topic(names[topic.name], topic.type)
        run_core(order, lambda topic, raw, stamp: writer.write(names[topic.name], raw, stamp))
        writer.close()
        times = []
        for _ in range(_ROUNDS):
            outcome = replay_recording(recording)
            assert outcome.agreement is not None
            assert outcome.agreement.equal
            times.append(outcome.replayed.control_time / outcome.samples)
    return Comparison('replay one sample', statistics.median(times), 'real time', SAMPLE_TIME)


def _median_time(call: Callable[[], object], rounds: int = _ROUNDS) -> float:
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)
