"""The recording on the disk, held against independent readers and against what can go wrong."""

import contextlib
import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
import zstandard
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Header, Message, MessageIndex
from mcap.stream_reader import StreamReader
from mcap_ros2.reader import read_ros2_messages
from read_back import description
from ros_testing import LIMIT
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from samples import PERIOD, RECORDED, START, sample
from small_disk import small_disk

from mount_recorder.bag_writer import BagWriter, RecordingError
from mount_recorder.record_file import RESERVE_STEP, RecordFile
from mount_recorder.schemas import SchemaError, schema_text, type_hash
from mount_ros.topics import DISPLACEMENT, TOPICS

STRING = 'std_msgs/msg/String'
TYPES = sorted({topic.type for topic in TOPICS})


@pytest.mark.parametrize('name', TYPES)
def test_type_hash_is_the_one_that_rosbags_computes(name):
    assert type_hash(name) == get_typestore(Stores.ROS2_JAZZY).hash_rihs01(name)


def test_schema_text_holds_each_dependency_once_depth_first():
    parts = schema_text('sensor_msgs/msg/Imu').split('\n' + '=' * 80 + '\n')
    names = [part.splitlines()[0] for part in parts[1:]]
    assert names == [
        'MSG: geometry_msgs/Quaternion',
        'MSG: geometry_msgs/Vector3',
        'MSG: std_msgs/Header',
        'MSG: builtin_interfaces/Time',
    ]


@pytest.mark.parametrize(
    ('name', 'word'),
    [
        ('JointState', 'package/msg/Name'),
        ('sensor_msgs/msg/NoSuchThing', 'NoSuchThing.msg'),
        ('no_such_package/msg/Thing', 'no_such_package'),
    ],
)
def test_unknown_type_is_refused_with_a_sentence(name, word):
    with pytest.raises(SchemaError, match=word):
        schema_text(name)


def test_mcap_reader_finds_every_message_with_good_checksums(drive):
    with (drive / 'drive_0.mcap').open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        messages = list(reader.iter_messages())
        statistics = reader.get_summary().statistics
        file.seek(0)
        records = list(StreamReader(file, validate_crcs=True).records)  # that of the whole file too
    assert isinstance(records[0], Header)
    assert records[0].profile == 'ros2'
    assert len(messages) == statistics.message_count == 1500
    assert statistics.chunk_count > 1
    last = [message for _, channel, message in messages if channel.topic == '/displacement'][-1]
    assert last.data == sample(DISPLACEMENT, 499)
    assert last.log_time == last.publish_time == START + 499 * PERIOD + 200_000


def test_message_indexes_point_at_their_messages(drive):
    entries = []
    with (drive / 'drive_0.mcap').open('rb') as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                content = zstandard.decompress(record.data, record.uncompressed_size)
            elif isinstance(record, MessageIndex):
                entries += [
                    (record.channel_id, time, struct.unpack_from('<BQHIQ', content, offset))
                    for time, offset in record.records
                ]
    assert len(entries) == 1500
    for channel, time, (opcode, _, found_channel, _, found_time) in entries:
        assert (opcode, found_channel, found_time) == (Opcode.MESSAGE, channel, time)


def test_rosbags_opens_the_recording_with_its_own_digests(drive):
    with AnyReader([drive]) as reader:
        store = get_typestore(Stores.ROS2_JAZZY)
        for connection in reader.connections:
            assert connection.digest == store.hash_rihs01(connection.msgtype)
        messages = [
            reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages()
            if connection.topic == '/coil_ripple'
        ]
    assert [message.position[0] for message in messages] == list(range(500))
    assert messages[7].name == ['coil_current', 'flux_density']


def test_mcap_ros2_support_decodes_the_recording_by_its_schema(drive):
    messages = list(read_ros2_messages(str(drive / 'drive_0.mcap'), topics=['/displacement']))
    assert [message.ros_msg.position for message in messages] == [[float(index)] for index in range(500)]


def test_channel_and_metadata_file_name_type_hash_and_offers_of_the_first_message(tmp_path):
    offers = []
    writer = BagWriter(tmp_path / 'bag')
    for name in ('/one', '/two'):
        writer.add_topic(name, STRING, lambda: offers)
    endless = {'sec': 9223372036, 'nsec': 854775807}
    offers += 2 * [{'durability': 'transient_local', 'deadline': endless}]
    writer.write('/one', b'\x00\x01\x00\x00', START)
    writer.close()
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as file:
        channel = next(record for record in StreamReader(file).records if isinstance(record, Channel))
    assert channel.message_encoding == 'cdr'
    assert channel.metadata['topic_type_hash'] == type_hash(STRING)
    qos = yaml.safe_load(channel.metadata['offered_qos_profiles'])
    assert qos == offers
    topic = description(tmp_path / 'bag')['topics_with_message_count'][0]['topic_metadata']
    assert topic['offered_qos_profiles'] == qos
    text = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    assert not {'&', '*'} & set(text), "rosbag2's reader knows no aliases"


def test_metadata_file_has_the_fields_of_version_9(drive):
    text = (drive / 'metadata.yaml').read_text()
    root = yaml.safe_load(text)['rosbag2_bagfile_information']
    assert list(root) == [
        'version',
        'storage_identifier',
        'duration',
        'starting_time',
        'message_count',
        'topics_with_message_count',
        'compression_format',
        'compression_mode',
        'relative_file_paths',
        'files',
        'custom_data',
        'ros_distro',
    ]
    assert root['version'] == 9
    assert root['storage_identifier'] == 'mcap'
    assert root['duration'] == {'nanoseconds': 499 * PERIOD}
    assert root['starting_time'] == {'nanoseconds_since_epoch': START + 200_000}
    assert root['message_count'] == 1500
    assert root['compression_format'] == root['compression_mode'] == ''
    assert root['relative_file_paths'] == ['drive_0.mcap']
    assert root['files'][0]['message_count'] == 1500
    assert root['ros_distro'] == 'jazzy'
    topic = root['topics_with_message_count'][0]
    assert topic['message_count'] == 500
    assert topic['topic_metadata']['type_description_hash'] == type_hash(DISPLACEMENT.type)


def test_metadata_record_in_the_file_equals_the_metadata_file(drive):
    with (drive / 'drive_0.mcap').open('rb') as file:
        records = list(make_reader(file).iter_metadata())
    assert [record.name for record in records] == ['rosbag2']
    assert yaml.safe_load(records[0].metadata['serialized_metadata']) == description(drive)


def test_recording_without_messages_is_a_valid_recording(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/text', STRING)
    writer.close()
    with AnyReader([tmp_path / 'bag']) as reader:
        assert [connection.topic for connection in reader.connections] == ['/text']
        assert list(reader.messages()) == []


def test_existing_folder_is_refused(tmp_path):
    with pytest.raises(RecordingError, match='exists already'):
        BagWriter(tmp_path)


def test_what_cannot_be_written_is_refused_with_a_sentence(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    with pytest.raises(RecordingError, match='add_topic'):
        writer.write('/text', b'1234', START)
    writer.add_topic('/text', STRING)
    writer.write('/text', b'1234', START)
    writer.close()
    content = (writer.folder / 'bag_0.mcap').read_bytes()
    writer.close()
    assert sorted(path.name for path in writer.folder.iterdir()) == ['bag_0.mcap', 'metadata.yaml']
    assert (writer.folder / 'bag_0.mcap').read_bytes() == content
    with pytest.raises(RecordingError, match='closed'):
        writer.write('/text', b'1234', START)


def fill(writer, limit=100_000):
    """Write until the disk refuses; return how many messages were handed over and the refusal."""
    for topic in RECORDED:
        writer.add_topic(f'/{topic.name}', topic.type)
    for index in range(limit):
        try:
            writer.write(f'/{RECORDED[index % 3].name}', sample(RECORDED[index % 3], index), START + index)
        except RecordingError as error:
            return index + 1, str(error)
    pytest.fail('the disk never became full')


def test_full_disk_leaves_a_complete_recording_up_to_the_last_chunk(tmp_path):
    writer = BagWriter(tmp_path / 'bag', open_file=small_disk((1 << 20) + 300_000))
    handed, sentence = fill(writer)
    assert 'no space left' in sentence
    assert 'closed and readable' in sentence
    assert str(writer.kept) in sentence
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as file:
        read = list(make_reader(file, validate_crcs=True).iter_messages())
    assert len(read) == writer.kept
    assert 0 < handed - writer.kept < 1000
    with AnyReader([tmp_path / 'bag']) as reader:
        assert reader.message_count == writer.kept
    assert not list((tmp_path / 'bag').glob('.*'))
    with pytest.raises(RecordingError, match='no space left'):
        writer.write('/displacement', b'1234', START)
    writer.close()
    assert writer.failure == sentence


def test_room_for_the_end_grows_with_the_recording(tmp_path, monkeypatch):
    monkeypatch.setattr('mount_recorder.record_file.RESERVE_STEP', 4096)
    writer = BagWriter(tmp_path / 'bag', chunk_size=1, open_file=small_disk(1 << 20))
    _, sentence = fill(writer)
    assert 'closed and readable' in sentence
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert len(summary.chunk_indexes) == writer.kept > 1500


def test_room_is_kept_where_the_c_library_must_write_it_for_the_file_system(tmp_path, monkeypatch):
    monkeypatch.setattr(os, 'posix_fallocate', lambda handle, _, size: os.pwrite(handle, b'\0', size - 1))
    file = RecordFile(tmp_path / 'file')
    for steps in (1, 3):
        file.keep_room(steps * RESERVE_STEP)
        assert (tmp_path / '.file.reserve').stat().st_size == steps * RESERVE_STEP
    file.close()


def test_broken_disk_leaves_whole_chunks(tmp_path):
    writer = BagWriter(tmp_path / 'bag', open_file=small_disk(1 << 24))
    for topic in RECORDED:
        writer.add_topic(f'/{topic.name}', topic.type)
    for index in range(1000):
        writer.write('/displacement', sample(DISPLACEMENT, index), START + index)
    kept = writer.kept
    writer._file.file.broken = True
    with pytest.raises(RecordingError, match='ends without its summary but with whole chunks'):
        writer.close()
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as file:
        assert sum(isinstance(record, Message) for record in records_until_cut(file)) == kept > 0


_LIMITED = """
import resource, signal, sys
sys.path[:0] = [{place!r}]
from test_writer import fill
from mount_recorder.bag_writer import BagWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))
writer = BagWriter({folder!r})
_, sentence = fill(writer)
print(writer.kept, sentence)
"""


def test_a_limit_on_the_size_of_files_ends_the_recording_with_whole_chunks(tmp_path):
    """On a real file: the system refuses what lies beyond it, and the reserve cannot help."""
    program = _LIMITED.format(place=str(Path(__file__).parent), folder=str(tmp_path / 'bag'))
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    ended = subprocess.run(
        [sys.executable, '-c', program], env=environment, capture_output=True, text=True, timeout=LIMIT
    )
    assert ended.returncode == 0, ended.stderr
    kept, _, sentence = ended.stdout.partition(' ')
    assert 'no space left' in sentence
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as file:
        assert sum(isinstance(record, Message) for record in records_until_cut(file)) == int(kept) > 1000


def test_disk_too_small_to_begin_leaves_nothing_behind(tmp_path):
    with pytest.raises(RecordingError, match='cannot be started'):
        BagWriter(tmp_path / 'bag', open_file=small_disk(100))
    assert not (tmp_path / 'bag').exists()


def records_until_cut(file):
    """Yield the records of a file that ends without its footer."""
    with contextlib.suppress(EndOfFile):
        yield from StreamReader(file, validate_crcs=True).records
