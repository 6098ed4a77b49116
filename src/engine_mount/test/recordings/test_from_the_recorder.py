"""What the recorder wrote beside the messages, as the reader understands it."""

import numpy as np
import pytest
import yaml
from compared_drives import LATCHED

from engine_mount.recordings.events import switching_times
from engine_mount.recordings.metadata import read_statement, readable_qos
from mount_recorder.metadata import qos_text


@pytest.mark.parametrize('text', ['', 'topics: [', '{topics: 3}'])
def test_statement_that_is_not_understood_is_empty(text):
    assert read_statement({'topics': text}) == {}
    assert read_statement({}) == {}


def test_switched_stretches_of_damping_that_flutters():
    time = np.arange(400)
    active = np.where(time % 30 < 15, 0.03, 0.0) * ((time > 100) & (time < 300))
    on, off = switching_times(1e-3 * time, active)
    assert (on.tolist(), off.tolist()) == ([0.101], [pytest.approx(0.285)])
    on, off = switching_times(1e-3 * time, (time % 200 < 100).astype(float))
    assert (on.tolist(), off.tolist()) == ([0.0, 0.2], [0.1, 0.3])
    assert [len(each) for each in switching_times(time[:0], active[:0])] == [0, 0]


def test_qos_of_old_bags_stands_in_numbers():
    time = {'sec': 0, 'nsec': 5}
    numbers = {
        'history': 3,
        'depth': 0,
        'reliability': 2,
        'durability': 1,
        'deadline': time,
        'lifespan': time,
        'liveliness': 1,
        'liveliness_lease_duration': time,
        'avoid_ros_namespace_conventions': False,
    }
    words = {'history': 'unknown', 'reliability': 'best_effort', 'durability': 'transient_local'}
    offer = {**numbers, **words, 'liveliness': 'automatic'}
    assert readable_qos(yaml.safe_dump([numbers])) == [offer]
    assert readable_qos(qos_text([offer, LATCHED])) == [offer, LATCHED]
    assert readable_qos([{**numbers, 'history': 9}])[0]['history'] == 'unknown'
    assert readable_qos([{'history': 9}]) == []
