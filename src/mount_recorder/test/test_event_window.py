"""Nothing is written before an event; then what came before it, and what follows."""

import tracemalloc
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Footer
from read_back import Kept, loss_statement, read_back, records_of
from small_disk import small_disk

from mount_recorder.bag_writer import BagWriter
from mount_recorder.event_window import ITEM_OVERHEAD, EventWindow
from mount_recorder.recorder import Recorder

STRING = 'std_msgs/msg/String'


class Drive:
    """A recorder around events, 30 before to 10 after; its clock stands at the arrival of each message."""

    def __init__(self, folder, before=30, memory=1 << 20, **options):
        self.now = self.ahead = 0  # of the system's clock before the steady one
        window = EventWindow('/event', before, 10, memory, lambda: self.now)
        writer = partial(BagWriter, **options)
        self.recorder = Recorder(folder, window=window, open_writer=writer, threaded=False)
        self._receivers = {
            name: self.recorder.add_topic(name, STRING, latched=name == '/latched')
            for name in ('/stream', '/latched', '/event')
        }
        self.recorder.begin()

    def send(self, topic, time, raw=b'boom'):
        self.now = time - self.ahead
        self._receivers[topic](raw, time, time)
        self.recorder._turn_end = 0.0
        self.recorder.poll()

    def stream(self, begin, end):
        for time in range(begin, end):
            self.send('/stream', time, time.to_bytes(8, 'little'))

    @property
    def folders(self):
        return [writer.folder.name for writer in self.recorder.writers]


@pytest.fixture(autouse=True)
def no_settling(monkeypatch):
    monkeypatch.setattr('mount_recorder.recorder._QUIET_PERIOD', 0.0)


@pytest.fixture
def drive(tmp_path):
    return Drive(tmp_path / 'bag')


def times_of(folder, topic='/stream'):
    return [kept.publish_time for kept in read_back(folder, topic)]


def test_nothing_is_written_without_an_event(drive, tmp_path):
    drive.stream(0, 100)
    drive.recorder.end()
    assert list(tmp_path.iterdir()) == []


def test_event_saves_what_came_before_and_what_follows_and_closes_the_recording(drive, tmp_path):
    drive.stream(0, 100)
    drive.send('/event', 100)
    drive.stream(101, 150)
    assert drive.folders == ['bag']
    assert times_of(tmp_path / 'bag') == [*range(70, 100), *range(101, 111)]
    assert times_of(tmp_path / 'bag', '/event') == [100]
    assert isinstance(records_of(tmp_path / 'bag' / 'bag_0.mcap')[-1], Footer)
    row = {'received': 101, 'kept': 40, 'lost': 0, 'missing': 0}
    assert loss_statement(tmp_path / 'bag')['/stream'] | {'received': 101} == row


@pytest.mark.parametrize('step', [3600, -3600])
def test_a_step_of_the_system_clock_takes_nothing_from_before_or_after_an_event(drive, tmp_path, step):
    drive.stream(10_000, 10_080)
    drive.ahead = step
    drive.stream(10_080 + step, 10_100 + step)
    drive.send('/event', 10_100 + step)
    drive.stream(10_101 + step, 10_104 + step)
    drive.ahead = 0
    drive.stream(10_104, 10_150)
    before, after = range(10_080 + step, 10_100 + step), range(10_101 + step, 10_104 + step)
    assert sorted(times_of(tmp_path / 'bag')) == sorted(
        [*range(10_070, 10_080), *before, *after, *range(10_104, 10_111)]
    )


def test_event_while_one_is_recorded_makes_the_recording_longer(drive, tmp_path):
    for event, end in ((0, 8), (8, 16), (16, 60)):
        drive.send('/event', event)
        drive.stream(event + 1, end)
    assert drive.folders == ['bag']
    assert times_of(tmp_path / 'bag', '/event') == [0, 8, 16]
    assert times_of(tmp_path / 'bag')[-1] == 26


def test_later_event_gives_another_recording_with_its_full_time_before(drive, tmp_path):
    for event in (100, 115):
        drive.stream(event - 14, event)
        drive.send('/event', event)
    drive.recorder.end()
    assert drive.folders == ['bag', 'bag_2']
    # The second holds again what the first had after its event.
    assert times_of(tmp_path / 'bag_2') == [*range(86, 100), *range(101, 115)]
    assert times_of(tmp_path / 'bag_2', '/event') == [100, 115]


def test_latched_message_that_left_the_memory_is_in_each_recording(drive, tmp_path):
    drive.send('/latched', 0, b'old')
    drive.send('/latched', 1, b'new')
    drive.stream(2, 100)
    drive.send('/event', 100)
    drive.recorder.end()
    assert read_back(tmp_path / 'bag', '/latched') == [Kept('/latched', b'new', log_time=70, publish_time=1)]


def test_memory_is_bounded(tmp_path):
    drive = Drive(tmp_path / 'bag', before=10**6, memory=100 * (ITEM_OVERHEAD + 8))
    drive.stream(0, 1000)
    assert drive.recorder.window.held_bytes == 100 * (ITEM_OVERHEAD + 8)
    drive.send('/event', 1000, bytes(8))
    drive.recorder.end()
    assert times_of(tmp_path / 'bag') == list(range(901, 1000))


def test_estimate_of_the_memory_covers_what_python_takes():
    window = EventWindow('/event', 1e18, 0.0, 1 << 24)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for index in range(20_000):
            # As received: every number and every message is an object of its own.
            time = 1_700_000_000_000_000_000 + index
            window.add(('/stream', bytes(index % 400), time, time + 1))
        taken = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert 0.6 * window.held_bytes < taken <= window.held_bytes <= 1 << 24


def test_full_disk_ends_it_and_what_an_event_lost_is_counted(tmp_path):
    drive = Drive(tmp_path / 'bag', open_file=small_disk((1 << 20) + 20_000), chunk_size=100)
    drive.stream(0, 100)
    for event in range(100, 10_000):
        if drive.recorder.failure:
            break
        drive.send('/event', event)
    assert 'no space left' in drive.recorder.failure
    assert 0 < drive.recorder.figures()['lost'] < 20
    assert len(times_of(tmp_path / 'bag')) == 30


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(['/stream', '/event']), st.integers(0, 12)), max_size=40))
def test_every_message_near_an_event_is_saved(tmp_path_factory, steps):
    drive = Drive(folder := tmp_path_factory.mktemp('bags') / 'bag')
    time, sent = 0, []
    for number, (topic, step) in enumerate(steps):
        time += step
        drive.send(topic, time, number.to_bytes(4, 'little'))
        sent.append((topic, time, number))
    drive.recorder.end()
    events = [time for topic, time, _ in sent if topic == '/event']
    near = {number for _, time, number in sent if any(event - 30 <= time <= event + 10 for event in events)}
    saved = []
    for name in drive.folders:
        numbers = [int.from_bytes(kept.raw, 'little') for kept in read_back(folder.with_name(name))]
        assert len(set(numbers)) == len(numbers), 'a message twice in one recording'
        saved += numbers
    assert set(saved) == near
