"""Comparing topics of types that this project does not know, by the definition that stands in the bag."""

from pathlib import Path

import numpy as np
import pytest
from compared_drives import add_answers, answers
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from samples import START

import engine_mount
from engine_mount.recordings.compare import compare
from engine_mount.recordings.difference import Tolerances
from engine_mount.recordings.events import recorded_events, recorded_marks
from mount_recorder.bag_writer import BagWriter

COUNT = 50
PERIOD = 10_000_000  # ns
LATER = START + 90_000_000_123
NAME = 'strange_msgs/msg/Thing'


def write_things(file: Path, fields: str, values, start: int = START, name: str = NAME) -> Path:
    """Write messages with the fields of `values(index)` and, where there is one, a header with the stamp."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(fields, name))
    definition, _ = store.generate_msgdef(name, ros_version=2)
    with file.open('wb') as stream:
        writer = Writer(stream)
        writer.start(profile='ros2', library='test')
        schema = writer.register_schema(name, 'ros2msg', definition.encode())
        channel = writer.register_channel('/thing', 'cdr', schema)
        for index in range(COUNT):
            stamp = start + index * PERIOD
            seconds, nanoseconds = divmod(stamp, 1_000_000_000)
            time = store.types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
            header = store.types['std_msgs/msg/Header'](stamp=time, frame_id='')
            message = store.types[name](header=header, **values(index))
            writer.add_message(channel, stamp, bytes(store.serialize_cdr(message, name)), stamp)
        writer.finish()
    return file


def compared(folder: Path, fields: str, values, others, *, start: int = START, tolerances=()):
    a = write_things(folder / 'a.mcap', fields, values)
    b = write_things(folder / 'b.mcap', fields, others, start)
    return compare(engine_mount.open(a), engine_mount.open(b), Tolerances(tolerances))


FIRST_FIELDS = {
    'float64 value\nstd_msgs/Header header': 'of equal length',
    'int32 value\nstd_msgs/Header header': 'of equal length',
    'int32 value\nint32 more\nstd_msgs/Header header\nfloat64[3] rest': 'of equal length',
    'uint8 value\nstd_msgs/Header header\nstring text': 'of many lengths',
}


def _values(fields: str, value, index: int) -> dict:
    found = {'value': value}
    if 'more' in fields:
        found |= {'more': index, 'rest': np.arange(3.0)}
    return {**found, 'text': 'x' * (index % 7)} if 'text' in fields else found


@pytest.mark.parametrize('start', [START, LATER], ids=['same stamps', 'other stamps'])
@pytest.mark.parametrize('fields', FIRST_FIELDS, ids=range(len(FIRST_FIELDS)))
def test_a_field_before_the_header_is_compared_and_the_stamp_is_not(fields, start, tmp_path):
    def values(index):
        return _values(fields, index, index)

    def others(index):
        return _values(fields, index + 5 * (index == 20), index)

    same = compared(tmp_path, fields, values, values, start=start)
    assert same.equal, same.sentences()
    different = compared(tmp_path, fields, values, others, start=start)
    assert not different.equal
    if FIRST_FIELDS[fields] == 'of equal length':
        (signal,) = different.differing
        assert (signal.name, signal.largest.difference) == ('thing.value', 5.0)
        assert signal.first.time == pytest.approx(0.2)
    else:
        assert 'messages that differ: 1 of thing' in different.sentences()


HIDDEN = 'std_msgs/Header header\nfloat64 value\nfloat32[4] ranges\nstring text'


@pytest.mark.parametrize('tolerances', [(), ('1%',)], ids=['to the bit', 'within 1 %'])
def test_what_no_signal_shows_is_compared_too(tolerances, tmp_path):
    """Arrays and texts have no name of a signal of their own."""

    def values(index):
        return {'value': 100.0, 'ranges': np.arange(4, dtype=np.float32), 'text': 'same'}

    def array(index):
        return {**values(index), 'value': 100.001, 'ranges': np.array([0, 1, 2 + (index < 3), 3], np.float32)}

    assert compared(tmp_path, HIDDEN, values, values, tolerances=tolerances).equal
    told = compared(tmp_path, HIDDEN, values, array, tolerances=tolerances)
    assert not told.equal
    assert 'messages that differ: 3 of thing' in told.sentences()
    text = compared(tmp_path, HIDDEN, values, lambda k: {**values(k), 'text': 'else'}, tolerances=tolerances)
    assert f'messages that differ: {COUNT} of thing' in text.sentences()


def test_a_topic_of_another_type_is_never_equal(tmp_path):
    def values(index):
        return {'value': index}

    fields = 'std_msgs/Header header\nint32 {}'
    a = write_things(tmp_path / 'a.mcap', fields.format('value'), values)
    b = write_things(tmp_path / 'b.mcap', fields.format('value'), values, name='strange_msgs/msg/Other')
    comparison = compare(engine_mount.open(a), engine_mount.open(b))
    assert not comparison.equal
    assert f'thing: in A it is {NAME}, in B strange_msgs/msg/Other' in comparison.sentences()


# Names of this project that belong to others.


@pytest.fixture
def with_camera(tmp_path):
    """Return recordings of a camera whose topics are called like ours, alone and beside the mount."""
    for folder in ('both', 'camera'):
        writer = BagWriter(tmp_path / folder)
        if folder == 'both':
            add_answers(writer, answers(400), marks=((100, 'a bump'),))
        for name in ('event', 'session', 'displacement', 'control_trace'):
            writer.add_topic(f'/camera/{name}', 'std_msgs/msg/Int32')
            writer.write(f'/camera/{name}', b'\x00\x01\x00\x00\x07\x00\x00\x00', START)
        writer.close()
    return tmp_path


@pytest.mark.parametrize('name', ['both', 'camera'])
def test_a_foreign_topic_called_event_is_none_of_ours(name, with_camera):
    recording = engine_mount.open(with_camera / name)
    kinds = [event.kind for event in recorded_events(recording)]
    assert kinds == (['mark', 'switch_on', 'switch_off'] if name == 'both' else [])
    texts = [mark.text for marks in recorded_marks(recording).values() for _, mark in marks]
    assert texts == ['a bump'] * (name == 'both')
