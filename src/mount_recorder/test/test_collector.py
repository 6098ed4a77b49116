"""The collector: everything, in the order of arrival, with its times."""

import threading
from itertools import pairwise

import pytest
from rclpy.node import Node
from ros_testing import LIMIT, wait_until

from mount_recorder.collector import Collector
from mount_ros.messages.cdr import message_class
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.qos import publisher_qos
from mount_ros.topics import AIR_GAP, CURRENT_SETPOINT, DISPLACEMENT


@pytest.fixture
def owner(context):
    node = Node('owner', namespace='mount_right', context=context)
    yield node
    node.destroy_node()


@pytest.fixture
def collector(owner):
    collector = Collector(owner)
    yield collector
    collector.stop()


class Sender:
    """Publishes stamps on some topics."""

    def __init__(self, node):
        self._node = node
        self._ends = {}

    def open(self, topic):
        end = self._node.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic))
        self._ends[topic] = end, ScalarsLayout(topic)
        return end

    def send(self, topic, stamp):
        end, layout = self._ends[topic]
        end.publish(layout.pack(stamp, [0.0] * len(topic.names)))


@pytest.fixture
def sender(owner):
    return Sender(owner)


def connect(collector, sender, *topics):
    ends = [sender.open(topic) for topic in topics]
    wait_until(
        lambda: not collector.unmatched() and all(end.get_subscription_count() for end in ends), 'connection'
    )


def test_messages_of_several_topics_come_in_the_order_of_their_arrival(collector, sender):
    received = []
    for topic in (DISPLACEMENT, CURRENT_SETPOINT):
        collector.collect(
            topic, lambda raw, arrival, sent, topic=topic: received.append((arrival, topic, stamp_of(raw)))
        )
    connect(collector, sender, DISPLACEMENT, CURRENT_SETPOINT)
    # All of it is in the queues before the first batch is taken: one topic after the other would be wrong.
    for stamp in range(50):
        for topic in (DISPLACEMENT, CURRENT_SETPOINT):
            sender.send(topic, stamp)
    collector.start()
    wait_until(lambda: len(received) == 100, 'arrival of all messages')
    arrivals = [arrival for arrival, *_ in received]
    assert arrivals == sorted(arrivals)
    for topic in (DISPLACEMENT, CURRENT_SETPOINT):
        assert [stamp for _, of, stamp in received if of is topic] == list(range(50))
    turns = sum(one[1] is not other[1] for one, other in pairwise(received))
    assert turns > 20, 'the topics must come mixed, as they were sent'


def test_latched_messages_reach_a_collector_that_comes_later(owner, sender):
    end = sender.open(AIR_GAP)
    sender.send(AIR_GAP, 7)
    late, received = Collector(owner), []
    try:
        late.collect(AIR_GAP, lambda raw, *_: received.append(stamp_of(raw)))
        late.start()
        wait_until(lambda: received == [7], 'arrival of the latched message')
        assert end.get_subscription_count() == 1
    finally:
        late.stop()


def test_stopping_takes_what_is_there_and_ends_the_thread(owner, collector, sender):
    received, witnessed, entered, released = [], [], threading.Event(), threading.Event()

    def wait_and_receive(raw, *_):
        entered.set()
        assert released.wait(LIMIT)
        received.append(stamp_of(raw))

    witness = Collector(owner)
    collector.collect(DISPLACEMENT, wait_and_receive)
    witness.collect(DISPLACEMENT, lambda raw, *_: witnessed.append(stamp_of(raw)))
    end = sender.open(DISPLACEMENT)
    wait_until(lambda: end.get_subscription_count() == 2 and not collector.unmatched(), 'connection')
    collector.start()
    witness.start()
    sender.send(DISPLACEMENT, 0)
    assert entered.wait(LIMIT)
    for stamp in range(1, 20):
        sender.send(DISPLACEMENT, stamp)
    wait_until(lambda: len(witnessed) == 20, 'arrival')
    stopping = threading.Thread(target=collector.stop)
    stopping.start()
    wait_until(collector._ending.is_set, 'the order to stop')
    released.set()  # only now the thread goes on: all but the first message wait in the queue
    stopping.join(LIMIT)
    collector.stop()
    witness.stop()
    assert received == list(range(20))
    assert not [thread for thread in threading.enumerate() if thread.name == 'owner_io']


def test_a_receiver_that_raises_costs_its_own_message_only(collector, sender, capfd):
    received = []

    def choke(raw, *_):
        if stamp_of(raw) == 1:
            raise ValueError('indigestible')
        received.append(stamp_of(raw))

    collector.collect(DISPLACEMENT, choke)
    assert collector.unmatched() == ['/mount_right/displacement']
    connect(collector, sender, DISPLACEMENT)
    collector.start()
    for stamp in range(4):
        sender.send(DISPLACEMENT, stamp)
    wait_until(lambda: received == [0, 2, 3], 'arrival of the others')
    assert 'a message was not taken: ValueError: indigestible' in capfd.readouterr().err


def test_the_end_of_the_thread_is_told(owner):
    """A receiver that fails past every border, as no exception of the middleware's own calls would."""
    told = []
    collector = Collector(owner, on_failure=told.append)

    def collapse(raw, received, sent):
        raise SystemExit('out of order')

    collector.collect(DISPLACEMENT, collapse)
    sender = Sender(owner)
    end = sender.open(DISPLACEMENT)
    wait_until(lambda: not collector.unmatched() and end.get_subscription_count(), 'connection')
    collector.start()
    sender.send(DISPLACEMENT, 1)
    wait_until(lambda: told, 'the failure')
    sentence = 'the thread that takes the messages has ended: SystemExit: out of order'
    assert told == [collector.failure] == [sentence]
    collector.stop()
