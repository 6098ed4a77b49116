"""Direct delivery within a process: in the sender's thread, once, published besides, never after the end."""

import threading

import pytest
from rclpy.node import Node
from ros_testing import LIMIT, wait_until

from mount_ros.data_path import DataPath
from mount_ros.data_thread import DataThread
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT

LAYOUT = ScalarsLayout(DISPLACEMENT)


def sample(stamp):
    return LAYOUT.pack(stamp, (1e-3,))


@pytest.fixture
def make_path(context):
    made = []

    def make(name, thread, lockstep=False):
        node = Node(name, context=context)
        made.append((DataPath(node, thread=thread, lockstep=lockstep), node))
        return made[-1][0]

    yield make
    for path, node in made:
        path.stop()
        node.destroy_node()


class Taken:
    def __init__(self):
        self.stamps = []
        self.threads = set()

    def __call__(self, raw):
        self.stamps.append(LAYOUT.unpack(raw)[0])
        self.threads.add(threading.current_thread())


def connected(make_path, context, *, shared=True, lockstep=False):
    """Return sender, what a receiver in the same process took, and what one elsewhere took."""
    thread = DataThread(context)
    sender = make_path('sender', thread, lockstep)
    receiver = make_path('receiver', thread if shared else DataThread(context), lockstep)
    elsewhere = make_path('elsewhere', DataThread(context), lockstep)
    send = sender.sender(DISPLACEMENT)
    within, outside = Taken(), Taken()
    receiver.subscribe(DISPLACEMENT, within, directly=True)
    elsewhere.subscribe(DISPLACEMENT, outside)
    for path in (sender, receiver, elsewhere):
        path.start()
    wait_until(lambda: not any(path.unmatched() for path in (sender, receiver, elsewhere)), 'connection')
    return send, receiver, within, outside


def test_a_message_is_taken_in_the_thread_of_its_sender_before_it_returns_and_published_too(
    make_path, context
):
    send, _, within, outside = connected(make_path, context)
    for stamp in range(100):
        send(sample(stamp))
        assert within.stamps[-1] == stamp
    wait_until(lambda: outside.stamps == list(range(100)), 'the messages elsewhere')
    assert within.stamps == list(range(100))  # what came by the middleware as well was not taken once more
    assert within.threads == {threading.current_thread()}


@pytest.mark.parametrize('how', [{'shared': False}, {'lockstep': True}])
def test_without_a_common_thread_and_in_lockstep_it_goes_by_the_middleware(make_path, context, how):
    send, _, within, _ = connected(make_path, context, **how)
    send(sample(7))
    wait_until(lambda: within.stamps == [7], 'the message')
    assert threading.current_thread() not in within.threads


def test_what_another_process_sends_is_taken_only_where_this_one_has_no_sender(make_path, context):
    stranger = make_path('stranger', DataThread(context))
    send = stranger.sender(DISPLACEMENT)
    _, _, within, outside = connected(make_path, context)
    alone = Taken()
    receiver = make_path('alone', DataThread(context))
    receiver.subscribe(DISPLACEMENT, alone, directly=True)
    receiver.start()
    wait_until(lambda: not receiver.unmatched() and not stranger.unmatched(), 'connection')
    wait_until(lambda: (send(sample(9)), alone.stamps and outside.stamps)[1], 'the message elsewhere')
    assert within.stamps == []


def test_nothing_is_taken_behind_the_end_of_a_path_that_waits_for_the_message_under_way(make_path, context):
    thread = DataThread(context)
    sender, receiver = make_path('sender', thread), make_path('receiver', thread)
    send = sender.sender(DISPLACEMENT)
    under_way, go_on, taken = threading.Event(), threading.Event(), []

    def take(raw):
        under_way.set()
        assert go_on.wait(LIMIT)
        taken.append(raw)

    receiver.subscribe(DISPLACEMENT, take, directly=True)
    sending = threading.Thread(target=send, args=(sample(1),))
    sending.start()
    assert under_way.wait(LIMIT)
    stopping = threading.Thread(target=receiver.stop)
    stopping.start()
    stopping.join(0.05)
    assert stopping.is_alive()
    go_on.set()
    sending.join()
    stopping.join()
    send(sample(2))
    assert len(taken) == 1
