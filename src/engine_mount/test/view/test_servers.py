"""The page and the Foxglove server, held against clients that are not ours."""

import asyncio
import json
import os
import signal
import struct
import threading

import aiohttp
import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from engine_mount.view.feed import FeedError, RecordedFeed
from engine_mount.view.model import Model
from engine_mount.view.view import open_feed, running_model, serve_view
from engine_mount.view.web import FoxgloveServer, Web
from mount_control.policy.contract import trace_fields
from mount_control.policy.registry import POLICIES

LIMIT = 30.0  # s


def run(coroutine):
    return asyncio.run(asyncio.wait_for(coroutine, LIMIT))


@pytest.fixture
def page(drive, free_port):
    """Return the page about a recording that is played fast."""
    feed = RecordedFeed(drive, rate=5.0)
    with running_model(feed, beside=True) as model:
        web = Web(model, feed.title, '127.0.0.1', free_port)
        web.start()
        yield web
        web.stop()


@pytest.fixture
def foxglove(drive, free_port):
    """Return the Foxglove server, and the feed that it serves when that is started."""
    feed = RecordedFeed(drive, rate=5.0)
    server = FoxgloveServer(feed.topics, free_port)
    yield server, feed
    feed.stop()
    server.stop()


def request(method, address, **headers):
    """Return status, text and headers of the answer."""

    async def answer():
        async with (
            aiohttp.ClientSession() as session,
            session.request(method, address, headers=headers) as got,
        ):
            return got.status, '' if got.status == 101 else await got.text(), got.headers

    return run(answer())


async def told(address, count):
    async with aiohttp.ClientSession() as session, session.ws_connect(f'{address}stream') as stream:
        return [json.loads((await stream.receive()).data) for _ in range(count)]


def test_the_stream_tells_the_whole_and_then_each_interval(page):
    first, *others = run(told(page.address, 60))
    keys = [panel['curves'][-1]['key'] for panel in first['chart']['panels']]
    assert keys[:2] == ['displacement', 'damping']
    numbers = [interval[0] for told_one in others for interval in told_one['intervals']]
    assert numbers == sorted({*numbers})
    assert any('displacement' in interval[2] for one in others for interval in one['intervals'])


@pytest.mark.slow
def test_a_viewer_that_does_not_read_holds_up_nobody(page):
    async def both():
        async with aiohttp.ClientSession() as session, session.ws_connect(f'{page.address}stream'):
            return await told(page.address, 200)

    found = run(both())
    assert len(found) == 200
    assert [one['state']['end'] for one in found if 'state' in one][-1].startswith('ended: no sample for ')


def test_the_page_loads_nothing_from_elsewhere(page):
    for name in ('', 'view.js', 'chart.js', 'view.css', 'page.css'):
        status, text, headers = request('GET', page.address + name)
        assert status == 200
        assert '://' not in text.replace('${scheme}://', '')
        assert "default-src 'self'" in headers['Content-Security-Policy']


def test_the_layout_has_the_fields_of_the_policy_and_the_namespace(page):
    page._model.state.namespace = '/right'
    page._model.state.parameters = {'mount_control': {'policy': 'switched_viscous'}}
    place = [*trace_fields(POLICIES['switched_viscous'])].index('magnitude')
    assert f'"/right/control_trace.position[{place}]"' in request('GET', f'{page.address}layout.json')[1]


@pytest.mark.parametrize(
    ('headers', 'status'),
    [
        ({'Host': 'localhost:8137'}, 200),
        ({'Host': '[::1]:8137'}, 200),
        ({'Host': '127.0.0.1'}, 200),
        ({'Host': 'elsewhere.example:8137'}, 403),
        ({'Host': '127.0.0.1.elsewhere.example'}, 403),
        ({'Origin': 'http://elsewhere'}, 403),
    ],
)
def test_a_page_on_loopback_has_no_other_name_and_answers_no_foreign_page(page, headers, status):
    assert request('GET', f'{page.address}view.js', **headers)[0] == status


def test_a_model_that_fails_says_so_and_ends_the_view(drive):
    ended = threading.Event()
    model = Model(RecordedFeed(drive), beside=False, on_failure=ended.set)
    model.interval = lambda messages: 1 / 0
    model.start()
    assert ended.wait(LIMIT)
    assert model.failure == 'the view has ended: ZeroDivisionError: division by zero'
    model.stop()


def test_a_recording_that_cannot_be_played_on_ends_the_view_and_says_why(drive, free_port, monkeypatch):
    monkeypatch.setattr(RecordedFeed, 'message', lambda feed, number: 1 / 0)
    ctrl_c = threading.Timer(LIMIT, os.kill, (os.getpid(), signal.SIGINT))  # ends a view that does not end
    ctrl_c.start()
    try:
        ended = r'has ended: .* was not played to its end: ZeroDivisionError'
        with open_feed(drive) as feed, pytest.raises(FeedError, match=ended):
            serve_view(feed, lambda line: None, port=free_port, beside=False)
    finally:
        ctrl_c.cancel()


def test_others_need_the_token(drive, free_port):
    feed = RecordedFeed(drive)
    page = Web(Model(feed, beside=False), feed.title, '0.0.0.0', free_port)
    page.start()
    try:
        own = '?' + page.address.split('?')[1]
        for query, status in (('', 403), ('?token=guess', 403), ('?token=gue%C3%9F', 403), (own, 200)):
            assert request('GET', f'http://127.0.0.1:{free_port}/{query}')[0] == status
    finally:
        page.stop()


def test_a_port_that_is_taken_is_named(page, drive):
    feed, port = RecordedFeed(drive), int(page.address[:-1].split(':')[-1])
    other = Web(Model(feed, beside=False), feed.title, '127.0.0.1', port)
    with pytest.raises(FeedError, match='choose another --port'):
        other.start()
    with pytest.raises(FeedError, match='choose another --foxglove-port'):
        FoxgloveServer(feed.topics, port)


async def channels_of(client, count):
    """Return {topic: channel} as soon as the server has told of `count`."""
    channels = {}
    while len(channels) < count:
        message = await client.receive()
        content = json.loads(message.data) if message.type == aiohttp.WSMsgType.TEXT else {}
        channels |= {channel['topic']: channel for channel in content.get('channels', ())}
    return channels


async def messages_on(client, count):
    """Return the payloads of `count` messages of the first subscription."""
    found = []
    while len(found) < count:
        message = await client.receive()
        if message.type == aiohttp.WSMsgType.BINARY and message.data[0] == 1:
            assert struct.unpack_from('<I', message.data, 1)[0] == 1
            found.append(message.data[13:])
    return found


def test_foxglove_gets_channels_with_definitions_and_the_very_messages(foxglove):
    server, feed = foxglove

    async def first_displacements():
        options = {'protocols': ['foxglove.sdk.v1'], 'max_msg_size': 0}
        async with aiohttp.ClientSession() as http, http.ws_connect(server.address, **options) as client:
            wanted = (await channels_of(client, len(feed.topics)))['/displacement']
            assert (wanted['encoding'], wanted['schemaEncoding']) == ('cdr', 'ros2msg')
            assert 'MSG: std_msgs/Header' in wanted['schema']
            subscription = {'id': 1, 'channelId': wanted['id']}
            await client.send_json({'op': 'subscribe', 'subscriptions': [subscription]})
            feed.start(server.take, pytest.fail)
            return await messages_on(client, 500)

    found = [deserialize_message(raw, JointState) for raw in run(first_displacements())]
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in found]
    assert (np.diff(stamps) > 0).all()
    assert all(message.name == ['mount'] for message in found)
