"""The data path between two nodes: served by the executor, between works, or no more."""

import os
import subprocess
import sys
import threading

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from ros_testing import LIMIT, wait_until

import mount_ros.data_thread
from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread, DataThreadEndedError, DataThreadError
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT


class End:
    """A node with a data path that keeps the stamps of what it receives and in which thread it did."""

    def __init__(self, context, name, thread=None):
        self.node = Node(name, context=context)
        self.path = DataPath(self.node, lockstep=True, thread=thread)
        self.stamps = []
        self.threads = set()
        self.layout = ScalarsLayout(DISPLACEMENT)

    def take(self, raw):
        self.stamps.append(self.layout.unpack(raw)[0])
        self.threads.add(threading.current_thread().name)

    def close(self):
        stopping = threading.Thread(target=self.path.stop, daemon=True)
        stopping.start()
        stopping.join(LIMIT)
        assert not stopping.is_alive(), 'the path does not end'
        self.node.destroy_node()


@pytest.fixture
def make_end(context):
    made = []

    def make(name, thread=None):
        made.append(End(context, name, thread))
        return made[-1]

    yield make
    for end in made:
        end.close()


@pytest.fixture
def pair(make_end):
    """A sender and a receiver of the displacement, connected, and the function that sends a stamp."""
    sender, receiver = make_end('sender'), make_end('receiver')
    publish = sender.path.sender(DISPLACEMENT)
    receiver.path.subscribe(DISPLACEMENT, receiver.take)
    sender.path.start()
    receiver.path.start()
    wait_until(lambda: not sender.path.unmatched() and not receiver.path.unmatched(), 'connection')
    receiver.sender_has_one = lambda: not sender.path.unmatched()
    return receiver, lambda stamp: publish(sender.layout.pack(stamp, (0.0,)))


def _data_threads():
    return [thread for thread in threading.enumerate() if thread.name == 'data']


@pytest.mark.parametrize('working', [False, True])
def test_what_is_no_more_subscribed_is_heard_no_more_until_it_is_again(pair, working):
    receiver, send = pair
    if working:
        receiver.path.add_poll(lambda: False)
    for turn in range(5):
        send(2 * turn)
        wait_until(lambda turn=turn: receiver.stamps[-1:] == [2 * turn], 'arrival')
        receiver.path.unsubscribe(DISPLACEMENT)
        receiver.path.unsubscribe(DISPLACEMENT)  # a second time changes nothing
        wait_until(lambda: receiver.path.node.count_subscribers('displacement') == 0, 'the end')
        send(2 * turn + 1)
        receiver.path.subscribe(DISPLACEMENT, receiver.take)
        wait_until(lambda: not receiver.path.unmatched(), 'publisher found')
        wait_until(lambda: receiver.path.node.count_subscribers('displacement') == 1, 'subscriber')
        wait_until(lambda: receiver.sender_has_one(), 'subscriber found')
    assert receiver.stamps == [0, 2, 4, 6, 8]


@pytest.mark.parametrize('working', [False, True])
def test_a_callback_that_raises_costs_its_own_message_only(pair, capfd, working):
    receiver, send = pair
    take = receiver.take

    def choke(raw):
        take(raw)
        if receiver.stamps[-1] == 1:
            raise ValueError('indigestible')

    receiver.take = choke
    receiver.path.subscribe(DISPLACEMENT, choke)
    wait_until(lambda: receiver.path.node.count_subscribers('displacement') == 2, 'second subscription')
    if working:
        receiver.path.add_poll(lambda: False)
    seen = len(receiver.stamps)
    for stamp in range(4):
        send(stamp)
    wait_until(lambda: len(receiver.stamps) >= seen + 7, 'arrival of all messages')
    assert 'message of displacement not used: ValueError: indigestible' in capfd.readouterr().err


def test_nodes_that_share_a_thread_are_served_until_the_last_one_leaves(context, make_end):
    thread = DataThread(context)
    one, other, sender = make_end('one', thread), make_end('other', thread), make_end('sender', thread)
    publish = sender.path.sender(DISPLACEMENT)
    for end in (one, other):
        end.path.subscribe(DISPLACEMENT, end.take)
    for end in (one, other, sender):
        end.path.start()
    wait_until(lambda: sender.path.node.count_subscribers('displacement') == 2, 'both subscriptions')
    wait_until(lambda: not any(end.path.unmatched() for end in (one, other, sender)), 'connection')
    assert len(_data_threads()) == 1
    publish(sender.layout.pack(1, (0.0,)))
    wait_until(lambda: 1 in one.stamps and 1 in other.stamps, 'arrival at both')
    one.path.stop()
    publish(sender.layout.pack(2, (0.0,)))
    wait_until(lambda: 2 in other.stamps, 'arrival at the one that stayed')
    assert 2 not in one.stamps
    other.path.stop()
    sender.path.stop()
    assert not _data_threads()
    last = make_end('last', thread)  # the thread serves again
    last.path.subscribe(DISPLACEMENT, last.take)
    last.path.start()
    assert len(_data_threads()) == 1
    last.path.stop()
    last.path.stop()


def test_no_message_is_lost_or_doubled_where_work_begins_and_ends(pair):
    receiver, send = pair
    for stamp in range(0, 40, 4):
        send(stamp)
        receiver.path.add_poll(lambda: False)
        send(stamp + 1)
        send(stamp + 2)
        receiver.path.remove_polls()
        send(stamp + 3)
        wait_until(lambda stamp=stamp: receiver.stamps[-1:] == [stamp + 3], 'arrival')
    assert receiver.stamps == list(range(40))
    assert receiver.threads == {'data'}


# What happens when the thread itself fails. Whoever would wait for ever does so in a thread of the test.


class CollapseError(BaseException):
    """What no border of a callback keeps from the thread."""


def _collapse():
    raise CollapseError('out of order')


def _outcome(call, *arguments):
    """Return what `call` raised, None if nothing; it must come to an end."""
    outcome = []

    def attempt():
        try:
            outcome.append(call(*arguments))
        except Exception as error:
            outcome.append(error)

    calling = threading.Thread(target=attempt, daemon=True)
    calling.start()
    calling.join(LIMIT)
    assert outcome, 'the call does not return'
    return outcome[0]


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_the_end_of_the_thread_is_told_and_nobody_waits_for_it(context, make_end):
    told = []
    thread = DataThread(context, told.append)
    end, other = make_end('end', thread), make_end('other', thread)
    end.path.start()
    assert _outcome(end.path.add_poll, _collapse) is None
    wait_until(lambda: told, 'the failure')
    assert told == ['the data thread has ended: CollapseError: out of order']
    assert end.path.failure == other.path.failure == told[0]
    refusal = _outcome(other.path.start)
    assert isinstance(refusal, DataThreadEndedError)
    assert str(refusal) == told[0]
    assert not _data_threads()
    # to be served no more is what has happened already
    assert _outcome(end.path.remove_polls) is None
    assert _outcome(end.path.stop) is None


def test_a_thread_that_does_not_answer_is_not_waited_for_for_ever(pair, monkeypatch):
    receiver, _ = pair
    blocked, release = threading.Event(), threading.Event()

    def block():
        blocked.set()
        return release.wait(LIMIT)

    receiver.path.add_poll(block)
    assert blocked.wait(LIMIT)
    monkeypatch.setattr(mount_ros.data_thread, '_CHANGE_TIMEOUT', 0.05)
    refusal = _outcome(receiver.path.remove_polls)
    release.set()
    monkeypatch.undo()
    assert isinstance(refusal, DataThreadError)
    assert 'did not respond for 0.05 s' in str(refusal)


def test_a_callback_that_would_wait_for_its_own_thread_is_refused(pair):
    receiver, send = pair
    receiver.path.add_poll(lambda: receiver.path.remove_polls() is not None)
    wait_until(lambda: receiver.path.refused, 'the refusal')
    assert 'cannot wait for the data thread' in receiver.path.refusal
    send(1)
    wait_until(lambda: receiver.stamps == [1], 'arrival')
    receiver.path.stop()
    assert len(_data_threads()) == 1  # that of the sender


def test_the_topics_of_a_node_are_remapped_with_it_and_its_data_node_keeps_its_registered_name(domain):
    rules = ['-r', 'displacement:=/car/travel', '-r', '__node:=left', '-r', '__ns:=/space']
    context = Context()
    rclpy.init(args=['--ros-args', *rules], context=context, domain_id=domain)
    owner = Node('mount_driver', context=context)
    path = DataPath(owner, name='mount_driver')
    path.sender(DISPLACEMENT)
    path.subscribe(CURRENT_SETPOINT, print)
    assert path.unmatched() == ['/car/travel', '/space/current_setpoint']
    assert (owner.get_name(), path.name) == ('left', '/space/mount_driver_io')
    path.stop()
    owner.destroy_node()
    rclpy.try_shutdown(context=context)


RESTLESS = """
import faulthandler, os, threading, time
import rclpy
from rclpy.node import Node
from mount_ros.data_path import DataPath
from mount_ros.environment import prepare_environment
from mount_ros.topics import AIR_GAP, COIL_RIPPLE, CURRENT_SETPOINT, DISPLACEMENT

prepare_environment()
rclpy.init()
topics = AIR_GAP, COIL_RIPPLE, CURRENT_SETPOINT, DISPLACEMENT
owner, writer = Node('owner'), DataPath(Node('writer'))

def come_and_go():
    while True:
        for publisher in [writer.publisher(topic) for topic in topics]:
            writer.node.destroy_publisher(publisher)

threading.Thread(target=come_and_go, daemon=True).start()
for _ in range(60):
    path = DataPath(owner)
    for topic in topics:
        path.subscribe(topic, lambda raw: None)
    path.start()
    time.sleep(0.02)
    path.stop()
os._exit(0)
"""


@pytest.mark.slow
def test_a_path_is_stopped_while_writers_come_and_go(domain):
    """An event of discovery that was queued when the path was stopped ended the process by signal 11."""
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    ended = subprocess.run(
        [sys.executable, '-c', RESTLESS], env=environment, capture_output=True, timeout=120
    )
    assert ended.returncode == 0, ended.stderr
