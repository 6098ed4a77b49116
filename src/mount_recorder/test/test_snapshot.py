"""Nothing is written before an event; then what came before it, and what follows."""

import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Footer
from read_back import Kept, description, loss_statement, read_back, records_of
from small_disk import small_disk

from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.diagnosis import OnFull, RecorderState, judge
from mount_recorder.queue import ITEM_OVERHEAD
from mount_recorder.recorder import Recorder
from mount_recorder.snapshot import Snapshot, SnapshotRule
from mount_ros.nodes.diagnostics import Level

STRING = 'std_msgs/msg/String'
RULE = SnapshotRule(before=30, after=10, memory=1 << 20)


class SteadyClock:
    """Stands at the time of arrival of the message that is written; the system's clock is `ahead` of it."""

    now = ahead = 0

    def __call__(self):
        return self.now

    def follow(self, snapshot):
        write = snapshot.write

        def timed(topic, raw, received, sent):
            self.now = received - self.ahead
            write(topic, raw, received, sent)

        snapshot.write, snapshot.steady = timed, self


def snapshot_of(folder, rule=RULE, **options):
    steady = SteadyClock()
    snapshot = Snapshot(folder, '/event', rule, lambda place: BagWriter(place, **options), steady)
    steady.follow(snapshot)
    snapshot.add_topic('/stream', STRING)
    snapshot.add_topic('/latched', STRING, latched=True)
    snapshot.add_topic('/event', STRING)
    return snapshot


def stream(snapshot, begin, end):
    for time in range(begin, end):
        snapshot.write('/stream', time.to_bytes(8, 'little'), time, time)


def times_of(folder, topic='/stream'):
    return [kept.publish_time for kept in read_back(folder, topic)]


def test_nothing_is_written_without_an_event(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    stream(snapshot, 0, 100)
    snapshot.flush()
    snapshot.close()
    assert list(tmp_path.iterdir()) == []
    assert snapshot.kept == 0


def test_event_saves_what_came_before_and_what_follows(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    stream(snapshot, 0, 100)
    snapshot.write('/event', b'boom', 100, 100)
    stream(snapshot, 101, 150)
    assert snapshot.folders == [tmp_path / 'bag']
    assert times_of(tmp_path / 'bag') == [*range(70, 100), *range(101, 111)]
    assert times_of(tmp_path / 'bag', '/event') == [100]


@pytest.mark.parametrize('step', [3600, -3600])
def test_a_step_of_the_system_clock_takes_nothing_from_before_or_after_an_event(tmp_path, step):
    snapshot = snapshot_of(tmp_path / 'bag')
    stream(snapshot, 10_000, 10_080)
    snapshot.steady.ahead = step
    stream(snapshot, 10_080 + step, 10_100 + step)
    snapshot.write('/event', b'boom', 10_100 + step, 10_100 + step)
    stream(snapshot, 10_101 + step, 10_104 + step)
    snapshot.steady.ahead = 0
    stream(snapshot, 10_104, 10_150)
    snapshot.close()
    before, after = range(10_080 + step, 10_100 + step), range(10_101 + step, 10_104 + step)
    assert sorted(times_of(tmp_path / 'bag')) == sorted(
        [*range(10_070, 10_080), *before, *after, *range(10_104, 10_111)]
    )


def test_event_while_one_is_recorded_makes_the_recording_longer(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    for event, end in ((0, 8), (8, 16), (16, 60)):
        snapshot.write('/event', b'boom', event, event)
        stream(snapshot, event + 1, end)
    assert snapshot.folders == [tmp_path / 'bag']
    assert times_of(tmp_path / 'bag', '/event') == [0, 8, 16]
    assert times_of(tmp_path / 'bag')[-1] == 26


def test_later_event_gives_another_recording_with_its_full_time_before(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    for event in (100, 115):
        stream(snapshot, event - 14, event)
        snapshot.write('/event', b'boom', event, event)
    snapshot.close()
    assert [folder.name for folder in snapshot.folders] == ['bag', 'bag_2']
    # The second holds again what the first had after its event.
    assert times_of(tmp_path / 'bag_2') == [*range(86, 100), *range(101, 115)]
    assert times_of(tmp_path / 'bag_2', '/event') == [100, 115]


def test_latched_message_that_left_the_memory_is_in_each_recording(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    snapshot.write('/latched', b'old', 0, 0)
    snapshot.write('/latched', b'new', 1, 1)
    stream(snapshot, 2, 100)
    snapshot.write('/event', b'boom', 100, 100)
    snapshot.close()
    assert read_back(tmp_path / 'bag', '/latched') == [Kept('/latched', b'new', log_time=70, publish_time=1)]


def test_memory_is_bounded_and_a_shortage_is_told(tmp_path):
    rule = SnapshotRule(before=10**6, memory=100 * (ITEM_OVERHEAD + 8))
    snapshot = snapshot_of(tmp_path / 'bag', rule)
    stream(snapshot, 0, 1000)
    figures = snapshot.figures()
    assert figures.held_bytes == rule.memory
    assert figures.short_of_memory
    recorder = Recorder(snapshot)
    verdict = judge(RecorderState('/bag', recorder.figures(), snapshot=figures), OnFull.STOP)
    assert verdict.level is Level.WARN
    assert 'raise snapshot_memory' in verdict.sentence
    snapshot.write('/event', b'boom', 1000, 1000)
    snapshot.close()
    assert times_of(tmp_path / 'bag') == list(range(901, 1000))


def test_estimate_of_the_memory_covers_what_python_takes(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag', SnapshotRule(before=10**18, memory=1 << 24))
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for index in range(20_000):
            # As received: every number and every message is an object of its own.
            time = 1_700_000_000_000_000_000 + index
            snapshot.write('/stream', bytes(index % 400), time, time + 1)
        taken = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert 0.6 * snapshot.figures().held_bytes < taken <= snapshot.figures().held_bytes <= 1 << 24


def test_recording_that_runs_at_the_end_is_closed(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    snapshot.write('/event', b'boom', 0, 0)
    snapshot.flush()
    snapshot.close()
    snapshot.close()
    assert description(tmp_path / 'bag')['message_count'] == 1
    assert isinstance(records_of(tmp_path / 'bag' / 'bag_0.mcap')[-1], Footer)
    assert (snapshot.kept, snapshot.pending) == (1, 0)


def test_recording_tells_what_was_received_beside_what_it_holds(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag')
    recorder = Recorder(snapshot)
    receive, mark = recorder.receiver('/stream'), recorder.receiver('/event')
    recorder.begin()
    for time in range(100):
        receive(b'12345678', time, time)
    mark(b'boom', 100, 100)
    recorder.end()
    assert loss_statement(tmp_path / 'bag')['/stream'] == {
        'received': 100,
        'kept': 30,
        'lost': 0,
        'missing': 0,
    }


def test_existing_folder_is_refused_before_anything_is_taken(tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(RecordingError, match='exists already'):
        snapshot_of(tmp_path / 'bag')


def test_unknown_topic_is_refused(tmp_path):
    with pytest.raises(RecordingError, match='add_topic'):
        snapshot_of(tmp_path / 'bag').write('/nobody', b'', 0, 0)


def test_full_disk_ends_it_and_every_later_message_is_refused(tmp_path):
    snapshot = snapshot_of(tmp_path / 'bag', open_file=small_disk((1 << 20) + 20_000), chunk_size=100)
    stream(snapshot, 0, 100)

    def go_on():
        for event in range(100, 10_000):
            snapshot.write('/event', b'boom', event, event)

    with pytest.raises(RecordingError, match='no space left'):
        go_on()
    with pytest.raises(RecordingError, match='no space left'):
        snapshot.write('/stream', b'', 20_000, 20_000)
    assert 0 < snapshot.unwritten(0) < 20
    assert len(times_of(tmp_path / 'bag')) == 30


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(['/stream', '/event']), st.integers(0, 12)), max_size=40))
def test_every_message_near_an_event_is_saved(tmp_path_factory, steps):
    folder = tmp_path_factory.mktemp('bags') / 'bag'
    snapshot = snapshot_of(folder)
    time, sent = 0, []
    for number, (topic, step) in enumerate(steps):
        time += step
        snapshot.write(topic, number.to_bytes(4, 'little'), time, time)
        sent.append((topic, time, number))
    snapshot.close()
    events = [time for topic, time, _ in sent if topic == '/event']
    near = {
        number
        for _, time, number in sent
        if any(event - RULE.before <= time <= event + RULE.after for event in events)
    }
    saved = []
    for place in snapshot.folders:
        numbers = [int.from_bytes(kept.raw, 'little') for kept in read_back(place)]
        assert len(set(numbers)) == len(numbers), 'a message twice in one recording'
        saved += numbers
    assert set(saved) == near
