"""Reading what this project, rosbag2 itself, a crash or a bad disk left."""

import numpy as np
import pytest
from compared_drives import bag_of
from mcap.writer import CompressionType, IndexType, Writer
from samples import PERIOD, START, joint_state, sample, write_drive

import engine_mount
from engine_mount.recordings import ReadingError, SeriesError
from mount_recorder.bag_writer import BagWriter
from mount_recorder.schemas import schema_text
from mount_ros.messages.cdr import string_message, wrench
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import COIL_RIPPLE, DISPLACEMENT, JOINT_STATE, SIM_MOUNT_FORCE

STRING = 'std_msgs/msg/String'
INDICES = np.arange(500)


def test_columns_carry_names_numbers_units_and_stamps(drive):
    recording = engine_mount.open(drive)
    assert recording.warnings == []
    series = recording['displacement']
    assert series.names == ('mount',)
    assert series.unit('mount') == 'm'
    np.testing.assert_array_equal(series['mount'], INDICES)
    np.testing.assert_array_equal(series.stamps, START + INDICES * PERIOD)
    np.testing.assert_array_equal(series.receive_times, START + INDICES * PERIOD + 200_000)
    np.testing.assert_array_equal(series.publish_times, series.receive_times)


def test_derivatives_are_columns_too(drive):
    series = engine_mount.open(drive)['coil_ripple']
    np.testing.assert_array_equal(series['flux_density'], INDICES + 1 / 8)
    np.testing.assert_array_equal(series.derivative('flux_density'), -(INDICES + 1 / 8))
    assert (series.unit('flux_density'), series.derivative_unit('flux_density')) == ('T', 'T/s')


def test_topic_is_found_below_its_namespace(tmp_path):
    recording = bag_of(tmp_path / 'bag', '/mount_right/displacement', JOINT_STATE, [sample(DISPLACEMENT, 3)])
    assert recording['displacement']['mount'] == [3.0]
    assert recording['displacement'].unit('mount') == 'm'


def test_ambiguous_topic_is_refused(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    for name in ('/left/displacement', '/right/displacement'):
        writer.add_topic(name, JOINT_STATE)
    writer.close()
    with pytest.raises(ReadingError, match='ambiguous'):
        engine_mount.open(tmp_path / 'bag')['displacement']


def test_unknown_topic_is_refused_with_the_known_ones(drive):
    with pytest.raises(ReadingError, match='/displacement, /coil_ripple'):
        engine_mount.open(drive)['road']


def test_empty_topic_has_its_registered_names_and_no_rows(tmp_path):
    series = bag_of(tmp_path / 'bag', '/coil_ripple', JOINT_STATE, [])['coil_ripple']
    assert series.names == COIL_RIPPLE.names
    assert series['coil_current'].size == series.stamps.size == 0
    with pytest.raises(ReadingError, match='no message'):
        engine_mount.open(tmp_path / 'bag').latched('coil_ripple')


def test_undefined_bytes_between_numbers_do_not_matter(tmp_path):
    layout = ScalarsLayout(DISPLACEMENT)
    raws = [bytearray(layout.pack(START + index * PERIOD, [float(index)])) for index in range(10)]
    for index, raw in enumerate(raws):
        raw[17:20] = bytes([index] * 3)  # behind the empty frame_id
    series = bag_of(tmp_path / 'bag', '/displacement', JOINT_STATE, map(bytes, raws))['displacement']
    assert series.layout is not None
    np.testing.assert_array_equal(series['mount'], range(10))


def test_names_in_another_order_at_equal_length_are_noticed(tmp_path):
    raws = [
        joint_state(START, ['ab', 'ba'], np.array([1.0, 2.0]), np.empty(0)),
        joint_state(START, ['ba', 'ab'], np.array([2.0, 1.0]), np.empty(0)),
    ]
    series = bag_of(tmp_path / 'bag', '/joints', JOINT_STATE, raws)['joints']
    np.testing.assert_array_equal(series['ab'], [1.0, 1.0])


def test_instruments_are_read_by_path(tmp_path):
    layout = OneNumberLayout(wrench)
    raws = [layout.pack(index * 1_000_000_000 + 5, 10.0 * index) for index in range(5)]
    series = bag_of(tmp_path / 'bag', '/sim/mount_force', SIM_MOUNT_FORCE.type, raws)['sim/mount_force']
    np.testing.assert_array_equal(series['wrench.force.z'], 10.0 * np.arange(5))
    np.testing.assert_array_equal(series.stamps, np.arange(5) * 1_000_000_000 + 5)
    with pytest.raises(SeriesError, match=r'wrench\.force\.z'):
        series['force']


def test_garbled_message_is_refused_with_its_number(tmp_path):
    raws = [string_message('fine'), b'\x00\x01\x00\x00\xff\xff\xff\x7fx']
    recording = bag_of(tmp_path / 'bag', '/event', STRING, raws)
    with pytest.raises(SeriesError, match='message 1'):
        list(recording['event'].messages())


# What is missing or damaged.


@pytest.mark.parametrize(
    ('old', 'new', 'warning'),
    [
        ('', '', 'metadata.yaml is missing'),
        ('rosbag2_bagfile_information:', 'rosbag2_bagfile_information: [', 'metadata.yaml is not readable'),
        ('message_count: 1500', 'message_count: 1600', 'lists 1600 messages'),
    ],
)
def test_a_wrong_metadata_file_is_a_warning(drive, old, new, warning):
    path = drive / 'metadata.yaml'
    text = path.read_text().replace(old, new) if old else path.unlink()
    if text:
        path.write_text(text)
    recording = engine_mount.open(drive)
    assert len(recording['displacement']) == 500
    assert any(warning in each for each in recording.warnings)


def test_empty_and_foreign_files_are_refused_with_a_sentence(tmp_path):
    for content, word in ((b'', 'empty'), (b'SQLite format 3\0', 'no MCAP file')):
        path = tmp_path / 'some.mcap'
        path.write_bytes(content)
        with pytest.raises(ReadingError, match=word):
            engine_mount.open(path)
    with pytest.raises(ReadingError, match='cannot be read'):
        engine_mount.open(tmp_path / 'nowhere.mcap')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(ReadingError, match='holds no MCAP file'):
        engine_mount.open(tmp_path / 'empty')


def test_other_storage_is_refused_with_a_sentence(drive):
    path = drive / 'metadata.yaml'
    path.write_text(path.read_text().replace('storage_identifier: mcap', 'storage_identifier: parquet'))
    with pytest.raises(ReadingError, match='parquet'):
        engine_mount.open(drive)


def test_pieces_are_read_in_their_order_and_missing_ones_are_named(tmp_path):
    folder = tmp_path / 'bag'
    folder.mkdir()
    for number in range(12):
        piece = write_drive(tmp_path / f'piece{number}', 5)
        (piece / f'piece{number}_0.mcap').rename(folder / f'bag_{number}.mcap')
    recording = engine_mount.open(folder)
    assert [file.path.name for file in recording.files] == [f'bag_{number}.mcap' for number in range(12)]
    text = (tmp_path / 'piece0' / 'metadata.yaml').read_text()
    listed = ''.join(f'  - bag_{number}.mcap\n' for number in (0, 1, 99))
    (folder / 'metadata.yaml').write_text(
        text.replace('  - piece0_0.mcap\n', listed).replace('files:\n', 'unused:\n')
    )
    recording = engine_mount.open(folder)
    assert len(recording['displacement']) == 10
    assert any('1 of 3 pieces are missing: bag_99.mcap' in warning for warning in recording.warnings)


@pytest.mark.parametrize('compression', list(CompressionType))
@pytest.mark.parametrize('indexed', [True, False])
def test_files_of_other_writers_are_read(tmp_path, compression, indexed):
    path = tmp_path / 'other.mcap'
    with path.open('wb') as file:
        writer = Writer(
            file,
            chunk_size=2000,
            compression=compression,
            index_types=IndexType.ALL if indexed else IndexType.NONE,
            repeat_channels=indexed,
            repeat_schemas=indexed,
        )
        writer.start('ros2', 'another')
        broken = writer.register_schema('pkg/msg/Broken', 'ros2msg', b'---\n')
        writer.register_channel('/broken', 'cdr', broken)
        schema = writer.register_schema(JOINT_STATE, 'ros2msg', schema_text(JOINT_STATE).encode())
        channel = writer.register_channel('/displacement', 'cdr', schema)
        for index in range(100):
            writer.add_message(1, START + index, b'\0\1\0\0' + bytes(index % 3), START)
            writer.add_message(channel, START + index, sample(DISPLACEMENT, index), START)
        writer.finish()
    recording = engine_mount.open(path)
    np.testing.assert_array_equal(recording['displacement']['mount'], range(100))
    assert recording.topics['/broken'].message_count == 100
    with pytest.raises(SeriesError, match='definition of pkg/msg/Broken in the recording is not readable'):
        recording['broken'].message(0)


def test_messages_outside_of_chunks_are_refused_with_the_way_out(tmp_path):
    with (tmp_path / 'other.mcap').open('wb') as file:
        writer = Writer(file, use_chunking=False)
        writer.start('ros2', 'another')
        writer.register_channel('/event', 'cdr', writer.register_schema(STRING, 'ros2msg', b'string data'))
        writer.add_message(1, START, string_message('the text'), START)
        writer.finish()
    with pytest.raises(ReadingError, match='outside of chunks: copy it by rosbags-convert'):
        engine_mount.open(tmp_path / 'other.mcap')


# Genuine bags.


def test_talker_with_integer_qos_is_read(genuine):
    recording = engine_mount.open(genuine / 'talker')
    assert recording.warnings == []
    assert recording.information.version == 4
    assert recording.latched('/topic').data
    assert recording.topics['/rosout'].offered_qos[0]['durability'] == 'transient_local'
    assert recording.topics['/parameter_events'].message_count == 0


def test_split_bag_with_missing_pieces_is_read(genuine):
    recording = engine_mount.open(genuine / 'wbag')
    assert any('3 of 5 pieces are missing: wbag_1.mcap' in warning for warning in recording.warnings)
    assert recording.message_count == 1246 + 1108
    assert sum(len(recording[name]) for name in recording) == recording.message_count


def test_types_that_are_not_installed_are_read_by_the_definition_in_the_bag(genuine):
    recording = engine_mount.open(genuine / 'cdr_test')
    arrays, basic = recording['/array_topic'], recording['/test_topic']
    assert (len(arrays), len(basic)) == (4, 3)
    assert basic['int32_value'].tolist() == [message.int32_value for message in basic.messages()]
    assert basic['int32_value'][0] == 123
    floats = [message.float64_values[2] for message in arrays.messages()]
    np.testing.assert_array_equal(arrays['float64_values[2]'], floats)
    assert any('carry no checksum' in warning for warning in recording.warnings)
