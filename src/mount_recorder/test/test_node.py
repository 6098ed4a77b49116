"""The recorder as a node, with publishers at 1 kHz in the real middleware."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from read_back import description, read_back, text_in
from ros_testing import LIMIT, wait_until
from samples import PERIOD, START, sample
from std_msgs.msg import String
from std_srvs.srv import Trigger

from mount_recorder.node import MountRecorder
from mount_ros.messages.event import read_mark
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.qos import publisher_qos
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, EVENT, SESSION

STREAMS = (DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT)
COUNT = 2000


@pytest.fixture
def make_recorder(make_node, tmp_path):
    """Return a function that creates a recorder with parameters."""
    values = {'uri': str(tmp_path / 'bag'), 'topics': [topic.name for topic in STREAMS]}
    return lambda **parameters: make_node(MountRecorder, **values | parameters)


@pytest.fixture
def recording(make_recorder, source):
    """Return a recorder at work and the publishers of its streams by topic, matched on both sides."""
    publishers = {topic: source.publisher(topic) for topic in STREAMS}
    recorder = make_recorder()
    assert recorder.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert recorder.trigger_activate() == TransitionCallbackReturn.SUCCESS
    wait_until(lambda: all(p.get_subscription_count() for p in publishers.values()), 'matched by publishers')
    wait_until(lambda: 'recording; 3 of 3' in recorder.judge().sentence, 'matched by recorder')
    return recorder, publishers


def publish_streams(publishers, count):
    """Publish `count` samples of each stream at 1 kHz."""
    begin = time.monotonic()
    for index in range(count):
        for topic, publisher in publishers.items():
            publisher.publish(sample(topic, index))
        threading.Event().wait(max(0.0, begin + (index + 1) * 1e-3 - time.monotonic()))


def assert_all_recorded(folder, count):
    for topic in STREAMS:
        recorded = [kept.raw for kept in read_back(folder, f'/{topic.name}')]
        assert recorded == [sample(topic, index) for index in range(count)]


@pytest.mark.real_time
def test_three_streams_at_1_khz_are_recorded_without_loss(recording, tmp_path):
    recorder, publishers = recording
    publish_streams(publishers, COUNT)
    # No wait: deactivation itself takes what is still under way.
    assert recorder.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert_all_recorded(tmp_path / 'bag', COUNT)
    bag = description(tmp_path / 'bag')
    assert bag['message_count'] == 3 * COUNT
    offered = bag['topics_with_message_count'][0]['topic_metadata']['offered_qos_profiles'][0]
    assert (offered['reliability'], offered['durability']) == ('reliable', 'volatile')


def test_verdict_names_the_last_stamp_and_missing_samples(recording):
    recorder, publishers = recording
    for index in (0, 1, 4):
        publishers[DISPLACEMENT].publish(sample(DISPLACEMENT, index))
    wait_until(lambda: recorder.judge().figures['last_stamp'] == START + 4 * PERIOD, 'written')
    assert recorder.judge().figures['missing./displacement'] == 2
    assert '/displacement 2' in recorder.judge().sentence


def test_latched_topic_received_before_activation_is_recorded(make_recorder, source, tmp_path):
    publisher = source.node.create_publisher(String, SESSION.name, publisher_qos(SESSION))
    recorder = make_recorder(topics=['session'])
    recorder.trigger_configure()
    kept = recorder._recorder._latched
    publisher.publish(String(data='first'))
    wait_until(lambda: '/session' in kept, 'latched message')
    recorder.trigger_activate()
    recorder.trigger_deactivate()
    assert b'first' in read_back(tmp_path / 'bag', '/session')[0].raw


@pytest.mark.parametrize(
    ('parameters', 'word'),
    [
        ({'uri': ''}, 'uri is empty'),
        ({'uri': '/tmp'}, 'exists already'),
        ({'topics': ['no_such_topic']}, 'no_such_topic'),
        ({'on_full': 'explode'}, 'stop or continue'),
        ({'split_size': 1000}, 'at least 1000000'),
        ({'automatic_marks': 'earthquake'}, 'earthquake'),
        ({'free_reserve': 10**15}, 'cannot be started'),
    ],
)
def test_wrong_parameter_is_refused_with_a_sentence(make_recorder, parameters, word):
    recorder = make_recorder(**parameters)
    assert recorder.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert word in recorder._refusal


def test_recorder_that_never_began_leaves_nothing_behind(make_recorder, tmp_path):
    recorder = make_recorder()
    recorder.trigger_configure()
    recorder.trigger_cleanup()
    assert not (tmp_path / 'bag').exists()


def test_sigint_closes_the_recording_and_exits_with_code_0(domain, domain_source, tmp_path):
    publishers = {topic: domain_source.publisher(topic) for topic in STREAMS}
    process = subprocess.Popen(
        [
            sys.executable,
            '-c',
            _AUTONOMOUS,
            '--ros-args',
            '-p',
            f'uri:={tmp_path / "bag"}',
            '-p',
            f'topics:={[topic.name for topic in STREAMS]}',
        ],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        wait_until(lambda: all(p.get_subscription_count() for p in publishers.values()), 'matched')
        wait_for_line(process, '3 of 3')
        publish_streams(publishers, COUNT)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=LIMIT)
    finally:
        process.kill()
    assert process.returncode == 0, output
    assert_all_recorded(tmp_path / 'bag', COUNT)


def wait_for_line(process, word):
    for line in process.stdout:
        if word in line:
            return
    pytest.fail(f'the recorder ended without {word!r}')


def marks_of(folder):
    return [read_mark(text_in(kept.raw), kept.log_time) for kept in read_back(folder, '/event')]


def test_marks_by_service_by_others_and_by_itself_are_recorded(make_recorder, source, context, tmp_path):
    others = source.node.create_publisher(String, EVENT.name, publisher_qos(EVENT))
    recorder = make_recorder(topics=['control_trace', 'event'], mark_text='a dent')
    recorder.trigger_configure()
    recorder.trigger_activate()
    assert recorder.set_parameters([Parameter('mark_text', value='a bump')])[0].successful
    assert not recorder.set_parameters([Parameter('uri', value='elsewhere')])[0].successful
    wait_until(others.get_subscription_count, 'matched')
    wait_until(lambda: recorder.judge().figures['publishers./event'] == 2, 'matched by recorder')
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(recorder)
    executor.add_node(source.node)
    client = source.node.create_client(Trigger, 'mount_recorder/mark')
    wait_until(client.service_is_ready, 'service')
    answer = client.call_async(Trigger.Request())
    executor.spin_until_future_complete(answer, timeout_sec=LIMIT)
    assert answer.result().success
    assert 'marked at' in answer.result().message
    others.publish(String(data='a sentence'))
    steps = source.publisher(CONTROL_TRACE)
    wait_until(
        lambda: steps.get_subscription_count() and recorder.judge().figures['publishers./control_trace'],
        'trace',
    )
    values = [float(name == 'damping_active') for name in CONTROL_TRACE.names]
    steps.publish(ScalarsLayout(CONTROL_TRACE).pack(START, values))
    wait_until(lambda: recorder.judge().figures['events'] == 3, 'the automatic mark')
    assert recorder.judge().figures['marks'] == 1
    executor.shutdown()
    recorder.trigger_deactivate()
    marks = marks_of(tmp_path / 'bag')
    assert sorted((mark.kind, mark.text) for mark in marks) == [
        ('mark', 'a bump'),
        ('mark', 'a sentence'),
        ('switch_on', 'damping on'),
    ]
    assert START in [mark.time for mark in marks]


def test_mark_of_an_inactive_recorder_is_refused(make_recorder):
    recorder = make_recorder()
    recorder.trigger_configure()
    response = recorder._on_mark(Trigger.Request(), Trigger.Response())
    assert not response.success
    assert 'not active' in response.message


# The process of the node, which takes itself through its transitions as a supervisor would.
_AUTONOMOUS = """
from mount_recorder.node import MountRecorder
from mount_ros.nodes.process import run_node

class Recorder(MountRecorder):
    def __init__(self):
        super().__init__()
        self.trigger_configure()
        self.trigger_activate()

    def judge(self):
        verdict = super().judge()
        print(verdict.sentence, flush=True)
        return verdict

run_node(Recorder)
"""
