"""Recordings that users order by `record`, beside whoever publishes."""

import os
import pty
import random
import signal
import subprocess
import threading
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from ros_testing import wait_until
from std_msgs.msg import String
from typer.testing import CliRunner

import engine_mount
from engine_mount.cli.command import app
from engine_mount.recordings.events import read_marks
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.qos import publisher_qos
from mount_ros.topics import CURRENT_SETPOINT, DIAGNOSTICS, DISPLACEMENT, EVENT

PERIOD = 1_000_000  # ns
BEGIN = 7_000_000_000  # ns
COUNT = 1500  # samples of each stream at 1 kHz


def start_record(command, source, *options, stdin=subprocess.DEVNULL):
    """Start `record` in the domain of `source` and return it once both sides know each other."""
    publishers = {topic: source.publisher(topic) for topic in (DISPLACEMENT, CURRENT_SETPOINT, EVENT)}
    domain = str(source.node.context.get_domain_id())
    process = command.start(
        'record', 'displacement', 'current_setpoint', *options,
        '--domain', domain, '--out', str(command.folder / 'bag'), stdin=stdin,
    )  # fmt: skip
    assert 'recording 3 topics' in process.stdout.readline()
    wait_until(lambda: all(p.get_subscription_count() for p in publishers.values()), 'found by the source')
    wait_until(heard_of_publishers(source.node, 3), 'found by the recorder')
    return process, publishers


def heard_of_publishers(node, count):
    """Return a condition: the recorder has said in its diagnostics that so many topics have a publisher."""
    heard = set()

    def hear(message):
        values = [entry for status in message.status for entry in status.values]
        heard.update(v.key for v in values if v.key.startswith('publishers.') and v.value != '0')

    node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, hear, publisher_qos(DIAGNOSTICS))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def condition():
        executor.spin_once(0.05)
        return len(heard) >= count

    return condition


def end_record(process):
    """End as Ctrl-C does; return exit code and output."""
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    return process.returncode, output


def samples(publishers, indices):
    """Publish samples of both streams at 1 kHz."""
    begin = time.monotonic()
    for index in indices:
        threading.Event().wait(max(0.0, begin + index * 1e-3 - time.monotonic()))
        for topic in (DISPLACEMENT, CURRENT_SETPOINT):
            publishers[topic].publish(ScalarsLayout(topic).pack(BEGIN + index * PERIOD, [1e-6 * index]))


@pytest.mark.real_time
def test_record_holds_all_that_was_published_in_several_files_with_the_mark(domain_source, command):
    process, publishers = start_record(command, domain_source, '--split', '1MB')
    samples(publishers, range(COUNT))
    long_texts = (random.Random(seed).randbytes(500_000).hex() for seed in range(2))  # more than one file
    texts = ['a bump', *long_texts]
    for text in texts:
        publishers[EVENT].publish(String(data=text))
    code, output = end_record(process)
    assert code == 0, output
    assert 'Nothing is known to be lost: 3 topics are complete.' in output
    folder = command.folder / 'bag'
    assert str(folder) in output
    assert len(list(folder.glob('*.mcap'))) > 1
    recording = engine_mount.open(folder)
    assert recording.warnings == []
    for name in ('displacement', 'current_setpoint'):
        assert recording[name].stamps.tolist() == [BEGIN + index * PERIOD for index in range(COUNT)]
    assert [mark.text for mark in read_marks(recording['event'])] == texts


def test_record_ends_with_code_1_where_samples_are_missing(domain_source, command):
    process, publishers = start_record(command, domain_source)
    samples(publishers, [0, 1, 4])
    code, output = end_record(process)
    assert code == 1, output
    assert 'Lost: 2 of ' in output


def test_a_key_press_marks(domain_source, command):
    keys, terminal = pty.openpty()
    process, publishers = start_record(command, domain_source, stdin=terminal)
    samples(publishers, range(10))
    os.write(keys, b'xm')
    code, output = end_record(process)
    os.close(keys)
    os.close(terminal)
    assert code == 0, output
    recording = engine_mount.open(command.folder / 'bag')
    assert len(recording['displacement']) == 10
    assert [mark.kind for mark in read_marks(recording['event'])] == ['mark']


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('record', 'no_such_topic'), "'no_such_topic' is no topic"),
        (('record', '--split', '60s'), 'no size such as 500MB'),
        (('record', '--split', '10kB'), 'at least 1000000 bytes'),
        (('drive', '--set', 'mount_recorder.split_size=100'), 'at least 1000000 bytes'),
    ],
)
def test_impossible_orders_leave_nothing_behind(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, list(arguments))
    assert words in str(result.exception)
    assert list(tmp_path.iterdir()) == []
