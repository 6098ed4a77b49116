"""What recover and cut keep besides messages: metadata, sequence numbers, losses."""

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from samples import PERIOD, START, sample

import engine_mount
from engine_mount.recordings.audit import audit
from engine_mount.recordings.edit import cut, recover
from engine_mount.recordings.losses import losses
from mount_recorder.bag_writer import BagWriter
from mount_recorder.losses import Reception
from mount_recorder.schemas import schema_text
from mount_ros.topics import DISPLACEMENT

COUNT = 200
NOTES = ({'vehicle': 'B', 'track': 'north'}, {'vehicle': 'B', 'track': 'south'})


def by_others(folder, end=True):
    """Write a recording as another program does; without its `end` the program was killed."""
    folder.mkdir()
    with (folder / 'other_0.mcap').open('wb') as stream:
        writer = Writer(stream, chunk_size=2000)
        writer.start('ros2')
        schema = writer.register_schema(DISPLACEMENT.type, 'ros2msg', schema_text(DISPLACEMENT.type).encode())
        channel = writer.register_channel('/displacement', 'cdr', schema)
        writer.add_metadata('track', NOTES[0])
        for index in range(COUNT):
            time = START + index * PERIOD
            writer.add_message(channel, time, sample(DISPLACEMENT, index), time, sequence=7 + 3 * index)
        writer.add_metadata('track', NOTES[1])
        if end:
            writer.finish()
        else:
            stream.flush()
    return folder


def recovered(folder, out):
    recover(folder, out)
    return out


def all_cut(folder, out):
    cut(engine_mount.open(folder), out)
    return out


COPIES = pytest.mark.parametrize('copy', [recovered, all_cut])


def stored(folder):
    (file,) = folder.glob('*.mcap')
    with file.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        notes = [dict(record.metadata) for record in reader.iter_metadata() if record.name == 'track']
        sequences = [message.sequence for _, _, message in reader.iter_messages()]
    return notes, sequences


@COPIES
@pytest.mark.parametrize('end', [True, False])
def test_metadata_and_sequence_numbers_come_with_the_messages(place, copy, end):
    folder = by_others(place(), end)
    notes, sequences = stored(copy(folder, place()))
    assert notes == list(NOTES)
    assert sequences == [7 + 3 * index for index in range(len(engine_mount.open(folder)['displacement']))]


# What the recorder says of its losses.


def lossy(folder, first=0, received=100, lost=40):
    """Write what a recorder leaves whose queue had no room for `lost` of `received` displacements."""
    writer = BagWriter(folder)
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.add_topic('/note', 'std_msgs/msg/String')
    writer.receptions = {'/displacement': Reception(received, lost), '/note': Reception(1)}
    writer.write('/note', b'\x00\x01\x00\x00\x02\x00\x00\x00a\x00', START + first * PERIOD)
    for index in range(first, first + received - lost):
        writer.write('/displacement', sample(DISPLACEMENT, index), START + index * PERIOD)
    writer.close()
    return folder


def losses_of(folder):
    recording = engine_mount.open(folder)
    audits = audit(recording)
    lost = {name: entry.lost for name, entry in audits.items() if entry.lost}
    assert losses(recording, audits).lossless is not bool(lost)
    return lost


@COPIES
def test_losses_of_the_recorder_stay_in_the_copy(place, copy):
    assert losses_of(lossy(place())) == {'/displacement': 40}
    copied = copy(lossy(place()), place())
    assert losses_of(copied) == {'/displacement': 40}
    assert losses_of(copy(copied, place())) == {'/displacement': 40}


def test_what_damage_took_is_counted_beside_what_the_recorder_lost(place):
    folder = lossy(place(), received=2000)
    file = folder / f'{folder.name}_0.mcap'
    content = bytearray(file.read_bytes())
    content[engine_mount.open(folder).files[0].chunks[-1].begin + 50] ^= 1
    file.write_bytes(content)
    gone = 1960 - len(engine_mount.open(folder)['displacement'])
    assert gone
    result = recover(folder, place())
    assert losses_of(result.folder) == {'/displacement': 40 + gone}
