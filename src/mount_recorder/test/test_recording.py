"""The queue between the receiving and the writing thread, and the recorder's verdict on itself."""

import itertools
import threading
import time
import tracemalloc
from dataclasses import replace

import pytest
from mcap.reader import make_reader
from read_back import loss_statement
from ros_testing import wait_until
from samples import PERIOD, START, sample
from small_disk import small_disk

from mount_recorder import recorder as recording
from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.diagnosis import Counted, OnFull, RecorderState, judge
from mount_recorder.queue import ReceivedQueue
from mount_recorder.recorder import Recorder, RecorderFigures, Unobserved
from mount_recorder.space import SpaceGuard
from mount_recorder.stamp_watch import StampWatch
from mount_ros.messages.scalars import stamp_of
from mount_ros.nodes.diagnostics import WINDOW, ActiveFindings, Level, SlidingWindow
from mount_ros.topics import DISPLACEMENT

STRING = 'std_msgs/msg/String'


def recorder_of(folder, memory_limit=1 << 22, threaded=True, space=None, on_loss=lambda _: None, **options):
    writer = BagWriter(folder, **options)
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.add_topic('/latched', STRING)
    return Recorder(writer, memory_limit=memory_limit, threaded=threaded, space=space, on_loss=on_loss)


@pytest.fixture
def clocked():
    """Return a function that makes a receiver take one message per nanosecond."""
    times = itertools.count(START)

    def clock(receive):
        def receive_now(raw):
            now = next(times)
            receive(raw, now, now)

        return receive_now

    return clock


def messages_of(folder):
    with (folder / f'{folder.name}_0.mcap').open('rb') as file:
        return [
            (channel.topic, message.data, message.log_time)
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()
        ]


def verdict_of(recorder, on_full=OnFull.STOP, **state):
    return judge(RecorderState('/data/bag', recorder.figures(), watches=recorder.watches, **state), on_full)


def test_every_message_between_begin_and_end_is_written(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(5000):
        receive(sample(DISPLACEMENT, index))
    recorder.end()
    assert [data for _, data, _ in messages_of(tmp_path / 'bag')] == [
        sample(DISPLACEMENT, index) for index in range(5000)
    ]
    assert recorder.figures().lost == 0


def test_stream_before_begin_is_dropped_and_latched_message_is_written_first(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    receive = clocked(recorder.receiver('/displacement'))
    receive_latched = clocked(recorder.latched_receiver('/latched'))
    receive_latched(b'first')
    receive_latched(b'last')
    receive(sample(DISPLACEMENT, 0))
    recorder.begin()
    receive(sample(DISPLACEMENT, 1))
    receive_latched(b'later')
    recorder.end()
    assert messages_of(tmp_path / 'bag') == [
        ('/latched', b'last', START + 1),
        ('/displacement', sample(DISPLACEMENT, 1), START + 3),
        ('/latched', b'later', START + 4),
    ]


def test_message_that_is_under_way_at_the_end_is_taken(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    wait = recorder._ending.wait

    def arrive_while_waiting(period):
        if threading.current_thread() is threading.main_thread():
            receive(sample(DISPLACEMENT, 7))
        return wait(period)

    recorder._ending.wait = arrive_while_waiting
    recorder.end()
    assert sample(DISPLACEMENT, 7) in [data for _, data, _ in messages_of(tmp_path / 'bag')]


def test_messages_after_the_end_are_dropped(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    receive = clocked(recorder.receiver('/displacement'))
    receive_latched = clocked(recorder.latched_receiver('/latched'))
    recorder.begin()
    recorder.end()
    receive(sample(DISPLACEMENT, 0))
    receive_latched(b'late')
    assert messages_of(tmp_path / 'bag') == []


def test_recording_cannot_begin_twice(tmp_path):
    recorder = recorder_of(tmp_path / 'bag')
    recorder.begin()
    recorder.end()
    with pytest.raises(RecordingError, match='configure a new one'):
        recorder.begin()


def test_full_queue_loses_and_counts_without_waiting(tmp_path, clocked):
    size = len(sample(DISPLACEMENT, 0))
    recorder = recorder_of(tmp_path / 'bag', memory_limit=10 * size)
    stuck = threading.Event()
    recorder._writer.write = lambda *_: stuck.wait()
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(1000):
        receive(sample(DISPLACEMENT, index))
    figures = recorder.figures()
    stuck.set()
    assert figures.received == 1000
    assert figures.lost >= 980
    assert figures.queued_bytes <= 10 * size
    verdict = verdict_of(recorder)
    assert verdict.level is Level.WARN
    assert 'of 1000 messages lost' in verdict.sentence
    recorder.end()


def test_recorder_without_a_thread_writes_when_it_is_polled(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag', threaded=False)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(100):
        receive(sample(DISPLACEMENT, index))
    assert recorder.figures().queued == 100
    assert recorder.poll() is False
    assert recorder.figures().queued == 0
    receive(sample(DISPLACEMENT, 100))
    recorder.end()
    assert recorder.figures().lost == 0
    assert [data for _, data, _ in messages_of(tmp_path / 'bag')] == [
        sample(DISPLACEMENT, index) for index in range(101)
    ]


def test_recorder_without_a_thread_ignores_polls_before_and_after_its_time(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag', threaded=False)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.poll()
    recorder.begin()
    receive(sample(DISPLACEMENT, 0))
    recorder.end()
    size = (tmp_path / 'bag' / 'bag_0.mcap').stat().st_size
    recorder.poll()
    assert (tmp_path / 'bag' / 'bag_0.mcap').stat().st_size == size


def test_recorder_without_a_thread_says_why_it_has_failed(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag', threaded=False)

    def fail(*_):
        raise RecordingError('no space left')

    recorder._writer.write = fail
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(100):
        receive(sample(DISPLACEMENT, index))
    recorder.poll()
    recorder.end()
    assert recorder.figures().lost == 100
    assert recorder.figures().failure == 'no space left'


def test_missing_samples_are_seen_while_they_are_recorded(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    recorder.watch('/displacement', DISPLACEMENT.rate, stamp_of)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in (0, 1, 2, 5, 6, 10):
        receive(sample(DISPLACEMENT, index))
    recorder.end()
    verdict = verdict_of(recorder)
    assert verdict.level is Level.WARN
    assert '/displacement 5' in verdict.sentence
    assert verdict.figures['missing./displacement'] == 5
    assert verdict.figures['last_stamp'] == START + 10 * PERIOD


@pytest.mark.parametrize(('on_full', 'level'), [(OnFull.STOP, Level.ERROR), (OnFull.CONTINUE, Level.WARN)])
def test_full_disk_is_an_error_or_a_warning_as_wished(tmp_path, clocked, on_full, level):
    recorder = recorder_of(tmp_path / 'bag', open_file=small_disk((1 << 20) + 100_000))
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    index = 0
    while not recorder.figures().failure:
        receive(sample(DISPLACEMENT, index))
        index += 1
    recorder.end()
    verdict = verdict_of(recorder, on_full)
    assert verdict.level is level
    assert 'no space left' in verdict.sentence
    figures = recorder.figures()
    assert figures.kept == len(messages_of(tmp_path / 'bag'))
    assert figures.kept + figures.lost == figures.received
    assert figures.queued_bytes == 0


def test_rare_messages_reach_the_disk_without_waiting_for_a_full_chunk(tmp_path, clocked, monkeypatch):
    monkeypatch.setattr('mount_recorder.recorder._FLUSH_PERIOD', 0.0)
    recorder = recorder_of(tmp_path / 'bag')
    recorder.begin()
    clocked(recorder.receiver('/displacement'))(sample(DISPLACEMENT, 0))
    waited = threading.Event()
    for _ in range(1000):
        if recorder.figures().kept:
            break
        waited.wait(0.01)
    assert recorder.figures().kept == 1
    recorder.end()


def test_little_space_is_a_warning_with_what_is_left(tmp_path):
    recorder = recorder_of(tmp_path / 'bag')
    verdict = verdict_of(recorder, free=500_000_000, rate=2e6)
    assert verdict.level is Level.WARN
    assert '0.5 GB left' in verdict.sentence
    verdict = verdict_of(recorder, free=5_000_000_000, rate=1e8)
    assert verdict.level is Level.WARN
    recorder.end()


@pytest.mark.parametrize('kind', ['lost', 'missing', 'misdated', 'unobserved'])
def test_a_burst_is_warned_of_in_the_same_words_for_as_long_as_the_window_lasts(kind):
    window, standing, told = SlidingWindow(Counted()), ActiveFindings(), []
    watch, figures = StampWatch(1000.0), RecorderFigures(0, 0, 0, 0, 0, 0, '')
    unobserved = {}
    for tenth in range(300):
        found = 7 * min(max(tenth - 49, 0), 5)
        figures = replace(figures, received=100 * tenth, lost=found if kind == 'lost' else 0)
        watch.lost, watch.misdated = (found if kind == name else 0 for name in ('missing', 'misdated'))
        if kind == 'unobserved' and found:
            unobserved = {'/displacement': Unobserved(found, 7, 'too short')}
        state = RecorderState('/data/bag', figures, watches={'/displacement': watch}, unobserved=unobserved)
        earlier = window.earlier(tenth / 10, state.counted)
        verdict = standing.keep(judge(state, OnFull.STOP, earlier))
        told.append((verdict.level, verdict.sentence))
    warned = [tenth for tenth, (level, _) in enumerate(told) if level is Level.WARN]
    assert (warned[0], len(warned)) == (50, warned[-1] - 49)
    assert 50 + 10 * WINDOW <= warned[-1] + 1 <= 54 + 10 * WINDOW
    assert len(set(told)) == 2


def test_one_warning_does_not_hide_another(tmp_path):
    recorder = recorder_of(tmp_path / 'bag')
    malformed = {'/displacement': Unobserved(1, 7, 'too short')}
    verdict = verdict_of(recorder, free=500_000_000, rate=2e6, unobserved=malformed)
    assert verdict.level is Level.WARN
    assert '/displacement 1 (the last of 7 bytes; too short)' in verdict.sentence
    assert '0.5 GB left' in verdict.sentence
    recorder.end()


def test_sound_recorder_says_how_many_topics_have_a_publisher(tmp_path):
    recorder = recorder_of(tmp_path / 'bag')
    verdict = verdict_of(recorder, publishers={'/displacement': 1, '/latched': 0})
    assert verdict.level is Level.OK
    assert '1 of 2 topics have a publisher' in verdict.sentence
    assert verdict.figures['publishers./latched'] == 0
    recorder.end()


def test_the_limit_of_the_queue_holds_for_the_memory_and_not_for_the_payload_alone():
    limit = 1 << 20
    queue = ReceivedQueue(limit)
    take = queue.taker('/topic')
    tracemalloc.start()
    for index in range(limit // 8):
        take(('/topic', index.to_bytes(8, 'little'), START + index, START + index + 1))
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert 0.5 * limit < held < limit
    assert len(queue) + queue.overflowed == limit // 8


def test_a_loss_that_cannot_be_told_ends_no_recording(tmp_path, clocked):
    size = len(sample(DISPLACEMENT, 0))

    def fail(count):
        raise ValueError('no node to tell it')

    recorder = recorder_of(tmp_path / 'bag', memory_limit=10 * size, on_loss=fail)
    stuck, write = threading.Event(), recorder._writer.write
    recorder._writer.write = lambda *item: stuck.wait() and write(*item)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(100):
        receive(sample(DISPLACEMENT, index))
    stuck.set()
    told = wait_until(lambda: recorder.unobserved.get('marks of losses'), 'the failure to be told')
    assert told == Unobserved(1, 0, 'ValueError: no node to tell it')
    before = recorder.figures().kept
    receive(sample(DISPLACEMENT, 100))
    wait_until(lambda: recorder.figures().kept > before, 'the next message on the disk')
    recorder.end()


def test_losses_of_the_recorder_stand_in_the_file_by_topic(tmp_path, clocked):
    size = len(sample(DISPLACEMENT, 0))
    told = []
    recorder = recorder_of(tmp_path / 'bag', memory_limit=10 * size, on_loss=told.append)
    recorder.watch('/displacement', DISPLACEMENT.rate, stamp_of)
    stuck, write = threading.Event(), recorder._writer.write
    recorder._writer.write = lambda *item: stuck.wait() and write(*item)
    receive, receive_other = (
        clocked(recorder.receiver('/displacement')),
        clocked(recorder.receiver('/latched')),
    )
    recorder.begin()
    for index in range(100):
        receive(sample(DISPLACEMENT, index))
    lost = recorder.overflowed()['/displacement']
    stuck.set()
    wait_until(lambda: told, 'the announcement of the loss')
    receive_other(b'text')
    recorder.end()
    assert (told, lost >= 80) == ([lost], True)
    rows = loss_statement(tmp_path / 'bag')
    assert rows['/displacement'] == {'received': 100, 'kept': 100 - lost, 'lost': lost, 'missing': 0}
    assert rows['/latched'] == {'received': 1, 'kept': 1, 'lost': 0, 'missing': 0}


def test_sound_recording_says_so_in_the_file(tmp_path, clocked):
    recorder = recorder_of(tmp_path / 'bag')
    recorder.watch('/displacement', DISPLACEMENT.rate, stamp_of)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.receiver('/latched')
    recorder.begin()
    for index in (0, 1, 4):
        receive(sample(DISPLACEMENT, index))
    recorder.end()
    assert loss_statement(tmp_path / 'bag') == {
        '/displacement': {'received': 3, 'kept': 3, 'lost': 0, 'missing': 2},
        '/latched': {'received': 0, 'kept': 0, 'lost': 0, 'missing': 0},
    }


@pytest.mark.parametrize(('on_full', 'level'), [(OnFull.STOP, Level.ERROR), (OnFull.CONTINUE, Level.WARN)])
def test_recording_is_closed_before_the_disk_is_full(tmp_path, clocked, monkeypatch, on_full, level):
    monkeypatch.setattr('mount_recorder.recorder._SPACE_PERIOD', 0.0)
    free = [250_000_000]
    guard = SpaceGuard(tmp_path / 'bag', 200_000_000, lambda _: free[0])
    recorder = recorder_of(tmp_path / 'bag', space=guard)
    receive = clocked(recorder.receiver('/displacement'))
    recorder.begin()
    for index in range(10):
        receive(sample(DISPLACEMENT, index))
    wait_until(lambda: recorder.figures().kept, 'the first chunk')
    free[0] = 199_000_000
    wait_until(lambda: recorder.figures().failure, 'the end')
    receive(sample(DISPLACEMENT, 10))
    verdict = verdict_of(recorder, on_full)
    assert verdict.level is level
    assert '199 MB left' in verdict.sentence
    assert 'closed and readable' in verdict.sentence
    assert len(messages_of(tmp_path / 'bag')) == 10
    recorder.end()
    assert recorder.figures().lost == 1


def test_space_is_that_of_the_disk_on_which_the_folder_will_be(tmp_path):
    asked = []
    guard = SpaceGuard(tmp_path / 'not' / 'yet' / 'made', 1, lambda place: asked.append(place) or 5)
    assert guard.free() == 5
    assert asked == [tmp_path]
    assert SpaceGuard(tmp_path, 1 << 62).shortage()
    assert not SpaceGuard(tmp_path, 0).shortage()


def test_end_beside_a_running_graph_does_not_wait_for_silence(tmp_path):
    recorder = recorder_of(tmp_path / 'bag')
    receive = recorder.receiver('/displacement')
    recorder.begin()
    ended = threading.Event()

    def go_on():
        while not ended.wait(1e-3):
            receive(b'message', time.time_ns(), time.time_ns())

    graph = threading.Thread(target=go_on)
    graph.start()
    begin = time.monotonic()
    recorder.end()
    duration = time.monotonic() - begin
    ended.set()
    graph.join()
    assert duration < 0.9 * recording._SETTLE_LIMIT
