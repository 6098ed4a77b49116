"""A topic with one writer: who else publishes it is named by discovery, whoever serves the subscription."""

import threading
import types

import pytest
from rclpy.node import Node
from ros_testing import LIMIT, wait_until

import mount_ros.publishers
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import message_class
from mount_ros.publishers import PublisherConflictError, PublisherWatch
from mount_ros.qos import publisher_qos
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT, TOPICS


@pytest.fixture
def publish_from(context):
    """Return a function that lets a node of this name publish a topic, and returns the node."""
    made = []

    def publish(name, topic=DISPLACEMENT, namespace='/car'):
        node = Node(name, namespace=namespace, context=context)
        node.create_publisher(message_class(topic.type), f'/car/{topic.name}', publisher_qos(topic))
        made.append(node)
        return node

    yield publish
    for node in made:
        node.destroy_node()


@pytest.fixture
def heard(context):
    """A data path in a namespace that hears the displacement, and what it was told of writers before."""
    owner = Node('listener', namespace='/car', context=context)
    path = DataPath(owner)
    path.received = []
    path.subscribe(DISPLACEMENT, lambda raw: path.received.append(path.publisher_watch.confirmed))
    path.start()
    yield path
    path.stop()
    owner.destroy_node()


def _settled(path):
    """Return what the watch finds; the names of nodes come a little after their publishers."""
    watch = path.publisher_watch
    wait_until(lambda: watch.check() or '_NAME_UNKNOWN' not in watch.suspected, 'the names')
    return watch.confirmed, watch.suspected


def test_topics_that_the_graph_uses_have_writers_and_others_have_none():
    assert {topic.name: topic.writers for topic in TOPICS if topic.writers} == {
        'displacement': ('mount_driver',),
        'coil_ripple': ('mount_driver',),
        'coil_temperature': ('mount_driver',),
        'engine_speed': ('mount_driver',),
        'current_setpoint': ('mount_control', 'mount_init'),
        'air_gap': ('mount_init',),
        'current_force_table': ('mount_init',),
    }


def test_a_second_publisher_is_known_before_its_first_message_is_used(heard, publish_from):
    publish_from('mount_driver_io')
    wait_until(lambda: heard.unmatched() == [], 'the driver')
    assert _settled(heard) == ('', '')
    stranger = publish_from('stranger', namespace='/elsewhere')
    publisher = next(each for each in stranger.publishers if each.topic == '/car/displacement')
    wait_until(lambda: publisher.get_subscription_count(), 'the subscription')
    named = heard.node.get_publishers_info_by_topic
    wait_until(lambda: any(each.node_name == 'stranger' for each in named('displacement')), 'its name')
    publisher.publish(message_class(DISPLACEMENT.type)())
    wait_until(lambda: heard.received, 'its message')
    sentence = (
        '/elsewhere/stranger must not publish displacement too (limit: one writer, mount_driver): end it'
    )
    assert heard.received == [sentence]
    with pytest.raises(PublisherConflictError, match='/elsewhere/stranger must not publish'):
        heard.publisher_watch.wait_for_sole(threading.Event())
    stranger.destroy_node()
    wait_until(lambda: _settled(heard) == ('', ''), 'the end of the stranger')
    heard.publisher_watch.wait_for_sole(threading.Event())


@pytest.mark.parametrize('name', ['mount_driver_io', 'player'])
def test_two_of_one_name_are_a_doubt_until_no_killed_one_can_be_left(heard, publish_from, monkeypatch, name):
    twins = [publish_from(name) for _ in range(2)]
    sentence = (
        f'/car/{name} must not publish displacement too (limit: one writer, mount_driver): a killed one is '
        'gone after 6 s, else end it'
    )
    wait_until(lambda: _settled(heard) == ('', sentence), 'the doubt')
    monkeypatch.setattr(mount_ros.publishers, 'LONGEST_DOUBT', 0.0)
    wait_until(lambda: _settled(heard)[0].startswith(f'/car/{name} must not publish'), 'the certainty')
    twins[0].destroy_node()
    wait_until(lambda: _settled(heard) == ('', ''), 'the end of one of them')


def test_an_activation_waits_for_the_end_of_a_doubt_and_no_longer_than_the_process_lives(heard, publish_from):
    twins = [publish_from('mount_driver_io') for _ in range(2)]
    wait_until(lambda: _settled(heard)[1], 'the doubt')
    ending = threading.Event()
    waiting = threading.Thread(target=heard.publisher_watch.wait_for_sole, args=(ending,))
    waiting.start()
    twins[0].destroy_node()
    waiting.join()
    twins.append(publish_from('mount_driver_io'))
    wait_until(lambda: _settled(heard)[1], 'the doubt')
    ending.set()
    with pytest.raises(PublisherConflictError, match='a killed one is gone after 6 s'):
        heard.publisher_watch.wait_for_sole(ending)


def test_each_of_several_writers_may_be_there_once(heard, publish_from):
    heard.subscribe(CURRENT_SETPOINT, lambda raw: None)
    publish_from('mount_control_io', CURRENT_SETPOINT)
    publish_from('mount_init_io', CURRENT_SETPOINT)
    count = heard.node.count_publishers
    wait_until(lambda: count('current_setpoint') == 2 and _settled(heard) == ('', ''), 'both of them')
    publish_from('stranger', CURRENT_SETPOINT)
    named = (
        '/car/stranger must not publish current_setpoint too '
        '(limit: one writer, mount_control and mount_init): end it'
    )
    wait_until(lambda: _settled(heard)[0] == named, 'the stranger')
    heard.unsubscribe(CURRENT_SETPOINT)
    assert _settled(heard) == ('', '')


def _info(name, kind=DISPLACEMENT.type, namespace='/car'):
    return types.SimpleNamespace(node_name=name, node_namespace=namespace, topic_type=kind)


def test_a_node_without_a_name_is_a_doubt_and_one_of_another_type_is_not_heard(heard, monkeypatch):
    infos = [_info('player'), _info('stranger', 'std_msgs/msg/String')]  # one may stand in for the writer
    monkeypatch.setattr(heard.node, 'get_publishers_info_by_topic', lambda topic: infos)
    heard.publisher_watch.check()
    assert (heard.publisher_watch.confirmed, heard.publisher_watch.suspected) == ('', '')
    infos[0] = _info('mount_driver_io')
    infos.append(_info('_NODE_NAME_UNKNOWN_', namespace='_NODE_NAMESPACE_UNKNOWN_'))
    heard.publisher_watch.check()
    assert heard.publisher_watch.confirmed == ''
    assert heard.publisher_watch.suspected.startswith(
        'a node without a name must not publish displacement too'
    )
    for name, namespace in (('evil', '/car'), ('mount_driver_io', '/other_car')):
        infos[-1] = _info(name, namespace=namespace)
        heard.publisher_watch.check()
        named = f'{namespace}/{name} must not publish displacement too'
        assert heard.publisher_watch.confirmed.startswith(named)


class Publishers:
    """The graph as discovery shows it to a subscription: the node that listens, and who publishes."""

    def __init__(self, *names):
        self.names = names

    def get_namespace(self):
        return '/'

    def get_publisher_count(self):
        return len(self.names)

    def get_publishers_info_by_topic(self, _):
        kind = DISPLACEMENT.type
        return [types.SimpleNamespace(node_name=n, node_namespace='/', topic_type=kind) for n in self.names]


def test_of_two_changes_found_by_two_threads_the_newer_one_is_delivered_last():
    publishers, delivered, first, going_on = (
        Publishers('mount_driver_io'),
        [],
        threading.Event(),
        threading.Event(),
    )

    def on_change(confirmed, suspected):
        if not first.is_set():
            first.set()
            going_on.wait(LIMIT)  # the first thread is held up amid its delivery
        delivered.append((bool(confirmed), bool(suspected)))

    watch = PublisherWatch(publishers, on_change)
    watch.add(DISPLACEMENT, publishers)
    watch.check()
    publishers.names = ('mount_driver_io', 'mount_driver_io')  # a doubt
    threads = [threading.Thread(target=watch.check)]
    threads[0].start()
    first.wait(LIMIT)
    publishers.names = ('mount_driver_io', 'stranger')
    threads.append(threading.Thread(target=watch.check))
    threads[1].start()
    wait_until(lambda: watch.confirmed, 'the second change')
    going_on.set()
    for thread in threads:
        thread.join(LIMIT)
    assert delivered[-1] == (True, False)
    assert len(delivered) == 2
