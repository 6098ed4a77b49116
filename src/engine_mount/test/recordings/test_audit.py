"""What the audit says of recordings with known losses."""

import numpy as np
import pytest
from compared_drives import bag_of
from samples import PERIOD, START, write_drive

import engine_mount
from engine_mount.recordings.audit import audit
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT


def test_sound_recording_has_nothing_to_tell(drive):
    audits = audit(engine_mount.open(drive))
    assert all(entry.sound for entry in audits.values())
    displacement = audits['/displacement']
    assert (displacement.expected, displacement.present, displacement.lost) == (500, 500, 0)
    assert displacement.longest_gap_s == pytest.approx(1e-3)
    assert displacement.answers.unanswered == 0


def test_lost_samples_are_counted_with_the_longest_gap(tmp_path):
    entry = audit(engine_mount.open(write_drive(tmp_path / 'bag', 100, skipped=range(40, 47))))[
        '/displacement'
    ]
    assert (entry.expected, entry.present, entry.lost, entry.duplicated) == (100, 93, 7, 0)
    assert entry.longest_gap_s == pytest.approx(8e-3)
    assert not entry.sound


def test_topics_without_a_rate_have_no_expectation(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/session', 'std_msgs/msg/String')
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.write('/session', b'\x00\x01\x00\x00\x01\x00\x00\x00\x00', START)
    writer.close()
    audits = audit(engine_mount.open(tmp_path / 'bag'))
    assert audits['/session'].expected is None
    assert audits['/session'].present == 1
    assert audits['/displacement'].remark == 'no message'


@pytest.mark.parametrize(('current', 'duplicated'), [(0.0, 0), (0.5, 1)])
def test_the_zero_current_with_which_control_ends_is_no_duplicate(tmp_path, current, duplicated):
    layout = ScalarsLayout(CURRENT_SETPOINT)
    raws = [layout.pack(START + PERIOD * min(each, 99), (current,)) for each in range(101)]
    bag = bag_of(tmp_path / 'bag', '/current_setpoint', CURRENT_SETPOINT.type, raws)
    entry = audit(bag)['/current_setpoint']
    assert (entry.expected, entry.present, entry.duplicated) == (101 - duplicated, 101, duplicated)


@pytest.mark.parametrize(('late', 'figures'), [(8, (6000, 0, 0)), (600, (None, None, None))])
def test_a_few_late_stamps_are_no_losses_and_with_many_nothing_is_counted(tmp_path, late, figures):
    stamps = START + PERIOD * np.arange(6000)
    stamps[np.random.default_rng(1).choice(5998, late, replace=False) + 1] += 7 * PERIOD // 10
    raws = [ScalarsLayout(DISPLACEMENT).pack(stamp, (0.0,)) for stamp in stamps.tolist()]
    entry = audit(bag_of(tmp_path / 'bag', '/displacement', DISPLACEMENT.type, raws))['/displacement']
    assert (entry.expected, entry.lost, entry.duplicated) == figures
    assert (figures[0] is None) == ('beside the rate (limit 1 %): only counted' in entry.remark)
