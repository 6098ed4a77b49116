"""The queue between the receiving and the writing thread, and the recorder's verdict on itself."""

import itertools
import threading
import time
import tracemalloc
from functools import partial

import pytest
from bursts import check_burst
from read_back import loss_statement, read_back
from ros_testing import wait_until
from samples import PERIOD, START, sample
from small_disk import small_disk

from mount_recorder import recorder as recording
from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.diagnosis import OnFull, judge
from mount_recorder.recorder import ITEM_OVERHEAD, Recorder, Unobserved
from mount_recorder.stamp_watch import StampWatch
from mount_ros.nodes.diagnostics import Level, SlidingWindow
from mount_ros.topics import DISPLACEMENT

STRING = 'std_msgs/msg/String'
SIZE = len(sample(DISPLACEMENT, 0)) + ITEM_OVERHEAD
QUIET = {'received': 0, 'lost': 0, 'free_bytes': 1 << 40, 'bytes_per_second': 0, 'folder': '/data/bag'}


class SlowDisk(BagWriter):
    """Writes nothing before `free` is set."""

    free = None

    def write(self, *message):
        if self.free is not None:
            self.free.wait()
        super().write(*message)


@pytest.fixture
def make(tmp_path):
    def made(writer=BagWriter, **options):
        recorder = Recorder(tmp_path / 'bag', open_writer=writer, **options)
        times = itertools.count(START)

        def clocked(receive):
            def receive_now(raw):
                now = next(times)
                receive(raw, now, now)

            return receive_now

        receive = clocked(recorder.add_topic('/displacement', DISPLACEMENT.type))
        latched = clocked(recorder.add_topic('/latched', STRING, latched=True))
        watch = recorder.watches['/displacement'] = StampWatch(1000.0)
        recorder.observers['/displacement'] = watch.observe
        return recorder, receive, latched

    return made


@pytest.fixture
def slow(monkeypatch):
    """Return the event that lets `SlowDisk` write."""
    free = threading.Event()
    monkeypatch.setattr(SlowDisk, 'free', free)
    yield free
    free.set()


def messages_of(folder):
    return [(kept.topic, kept.raw, kept.log_time) for kept in read_back(folder)]


def samples(*indices):
    return [sample(DISPLACEMENT, index) for index in indices]


def test_all_between_begin_and_end_is_written_the_last_latched_message_before_first(make, tmp_path):
    recorder, receive, receive_latched = make()
    receive_latched(b'first')
    receive_latched(b'last')
    receive(sample(DISPLACEMENT, 0))
    recorder.begin()
    for raw in samples(*range(1, 5000)):
        receive(raw)
    receive_latched(b'later')
    recorder.end()
    receive(sample(DISPLACEMENT, 0))
    receive_latched(b'late')
    expected = [
        ('/displacement', raw, START + 3 + index) for index, raw in enumerate(samples(*range(1, 5000)))
    ]
    written = sorted(messages_of(tmp_path / 'bag'), key=lambda message: message[2])
    assert written == [('/latched', b'last', START + 1), *expected, ('/latched', b'later', START + 5002)]
    assert recorder.figures()['lost'] == 0
    with pytest.raises(RecordingError, match='configure a new one'):
        recorder.begin()


def test_message_that_is_under_way_at_the_end_is_taken(make, tmp_path):
    recorder, receive, _ = make()
    recorder.begin()
    under_way = threading.Timer(recording._QUIET_PERIOD / 2, receive, samples(7))
    under_way.start()
    recorder.end()
    assert [raw for _, raw, _ in messages_of(tmp_path / 'bag')] == samples(7)


def test_end_beside_a_running_graph_does_not_wait_for_silence(make):
    recorder, *_ = make()
    receive = recorder.add_topic('/other', STRING)
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


def test_full_queue_loses_without_waiting_and_counts_by_topic_in_figures_and_file(make, tmp_path, slow):
    lost_at_once = []
    recorder, receive, receive_latched = make(SlowDisk, memory_limit=10 * SIZE, on_loss=lost_at_once.append)
    recorder.begin()
    for raw in samples(*range(1000)):
        receive(raw)
    figures = recorder.figures()
    assert (figures['received'], figures['lost'] >= 980) == (1000, True)
    assert figures['queued_bytes'] <= 10 * SIZE
    slow.set()
    wait_until(lambda: lost_at_once, 'the announcement of the loss')
    receive_latched(b'text')
    recorder.end()
    lost = recorder.figures()['lost']
    assert lost_at_once == [lost] == [recorder.figures_by_topic()['lost./displacement']]
    rows = loss_statement(tmp_path / 'bag')
    assert rows['/displacement'] == {'received': 1000, 'kept': 1000 - lost, 'lost': lost, 'missing': 0}
    assert rows['/latched'] == {'received': 1, 'kept': 1, 'lost': 0, 'missing': 0}


def test_a_loss_that_cannot_be_reported_ends_no_recording(make, slow):
    def fail(count):
        raise ValueError('no node to report it')

    recorder, receive, _ = make(SlowDisk, memory_limit=10 * SIZE, on_loss=fail)
    recorder.begin()
    for raw in samples(*range(100)):
        receive(raw)
    slow.set()
    found = wait_until(lambda: recorder.unobserved.get('marks of losses'), 'the failure to be reported')
    assert found == Unobserved(1, '0 bytes; ValueError: no node to report it')
    before = recorder.figures()['kept']
    receive(sample(DISPLACEMENT, 100))
    wait_until(lambda: recorder.figures()['kept'] > before, 'the next message on the disk')
    recorder.end()


def test_the_limit_of_the_queue_holds_for_the_memory_and_not_for_the_payload_alone(make, slow):
    limit = 1 << 20
    recorder, *_ = make(SlowDisk, memory_limit=limit)
    receive = recorder.add_topic('/other', STRING)
    recorder.begin()
    tracemalloc.start()
    for index in range(limit // 8):
        receive(index.to_bytes(8, 'little'), START + index, START + index + 1)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert 0.5 * limit < held < limit
    slow.set()
    recorder.end()


def test_missing_samples_are_seen_while_they_are_recorded_and_stand_in_the_file(make, tmp_path):
    recorder, receive, _ = make()
    recorder.begin()
    for raw in samples(0, 1, 2, 5, 6, 10):
        receive(raw)
    recorder.end()
    assert recorder.figures_by_topic() == {'missing./displacement': 5, 'misdated./displacement': 0}
    assert recorder.last_stamp == START + 10 * PERIOD
    row = {'received': 6, 'kept': 6, 'lost': 0, 'missing': 5}
    assert loss_statement(tmp_path / 'bag')['/displacement'] == row


def test_full_disk_ends_the_recording_and_counts_what_is_lost(make, tmp_path):
    disk = partial(BagWriter, open_file=small_disk((1 << 20) + 100_000))
    recorder, receive, _ = make(disk)
    recorder.begin()
    for index in itertools.count():
        receive(sample(DISPLACEMENT, index))
        if recorder.failure:
            break
    recorder.end()
    assert 'no space left' in recorder.failure
    figures = recorder.figures()
    assert figures['kept'] == len(messages_of(tmp_path / 'bag'))
    assert figures['kept'] + figures['lost'] == figures['received']
    assert figures['queued_bytes'] == 0


def test_rare_messages_reach_the_disk_without_waiting_for_a_full_chunk(make):
    recorder, receive, _ = make()
    recorder.begin()
    receive(sample(DISPLACEMENT, 0))
    wait_until(lambda: recorder.figures()['kept'] == 1, 'the message on the disk')
    recorder.end()


def test_recording_is_closed_before_the_disk_is_full(make, tmp_path, monkeypatch):
    free = 250_000_000
    monkeypatch.setattr('mount_recorder.recorder.free_space', lambda _: free)
    recorder, receive, _ = make(free_reserve=200_000_000)
    recorder.begin()
    for raw in samples(*range(10)):
        receive(raw)
    wait_until(lambda: recorder.figures()['kept'], 'the first chunk')
    free = 199_000_000
    wait_until(lambda: recorder.failure, 'the end')
    receive(sample(DISPLACEMENT, 10))
    assert '199 MB left' in recorder.failure
    assert 'closed and readable' in recorder.failure
    assert len(messages_of(tmp_path / 'bag')) == 10
    recorder.end()
    assert recorder.figures()['lost'] == 1
    with pytest.raises(RecordingError, match='cannot be started: 199 MB'):
        Recorder(tmp_path / 'another', free_reserve=200_000_000)


# The verdict.


@pytest.mark.parametrize(('on_full', 'level'), [(OnFull.STOP, Level.ERROR), (OnFull.CONTINUE, Level.WARN)])
def test_failure_is_an_error_or_a_warning_as_wished(on_full, level):
    verdict = judge(QUIET, {}, {}, failure='no space left', on_full=on_full)
    assert verdict.level is level
    assert 'no space left' in verdict.sentence
    assert (verdict.figures['failed'], verdict.figures['fatal']) == (True, on_full is OnFull.STOP)


@pytest.mark.parametrize(
    ('figures', 'words'),
    [
        ({'free_bytes': 500_000_000, 'bytes_per_second': 2_000_000}, ['0.5 GB left']),
        ({'free_bytes': 5_000_000_000, 'bytes_per_second': 100_000_000}, ['5.0 GB left']),
        ({'lost': 3, 'received': 1000}, ['3 of 1000 messages lost']),
        ({'missing./displacement': 5}, ['/displacement 5']),
        (
            {'malformed./displacement': 1, 'free_bytes': 500_000_000},
            ['/displacement 1 (the last of 7 bytes; too short)', '0.5 GB left'],
        ),
    ],
)
def test_each_finding_is_a_warning_with_its_numbers_and_hides_no_other(figures, words):
    verdict = judge({**QUIET, **figures}, {}, {'/displacement': Unobserved(1, '7 bytes; too short')})
    assert verdict.level is Level.WARN
    assert all(word in verdict.sentence for word in words)


def test_sound_recorder_says_how_many_topics_have_a_publisher():
    figures = {**QUIET, 'publishers./displacement': 1, 'publishers./latched': 0}
    verdict = judge(figures, {}, {})
    assert (verdict.level, verdict.sentence) == (Level.OK, 'recording; 1 of 2 topics have a publisher')


@pytest.mark.parametrize(
    'key', ['lost', 'missing./displacement', 'misdated./displacement', 'malformed./displacement']
)
def test_a_burst_is_warned_of_in_the_same_words_for_as_long_as_the_window_lasts(key):
    window = SlidingWindow({})

    def judge_at(time, received, found):
        figures = {**QUIET, 'received': received, key: found}
        unobserved = {'/displacement': Unobserved(1, '7 bytes; too short')}
        return judge(figures, window.earlier(time, figures), unobserved)

    check_burst(judge_at)
