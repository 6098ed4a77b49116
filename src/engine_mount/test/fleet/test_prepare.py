"""What is compiled ahead is what a fleet's index and replay would compile."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import ros_testing

_AFTER = """
import sys
from mount_recorder.session import session_text
from engine_mount.fleet import catalogue, replay
from engine_mount.fleet.places import places
from engine_mount.drives.loop import recording
from engine_mount.fleet.example import prepare
from ros_testing import compiled_so_far

prepare(scenarios=['motorway'], policies=['switched_viscous'])
before = compiled_so_far()
recording.LONG_CHUNK_SIZE = 4000  # bytes: many chunks, as in a recording of a car
sim = {'scenario': 'motorway', 'timeline.duration': 4.0, 'seed': 3}
parameters = {'mount_sim': sim, 'mount_control': {'policy': 'switched_viscous'}}
session = session_text({'parameters': parameters})
recording.record_core(recording.Path(sys.argv[1]) / 'drive', parameters, session)
for place in places([sys.argv[1]]).values():
    path, changes = recording.Path(place.uri), {'mount_control': {'highest_current': 0.7}}
    row, = catalogue.rows_of(path, place)['recordings']
    replayed, = replay.rows_of(path, place, changes)['result']
    print(row['reason'] or 'indexed', replayed['outcome'], len(before), sorted(compiled_so_far() - before))
"""


@pytest.mark.slow
def test_a_worker_of_a_fleet_finds_everything_compiled_that_it_needs(tmp_path):
    support = {**os.environ, 'PYTHONPATH': str(Path(ros_testing.__file__).parent)}
    run = subprocess.run(
        [sys.executable, '-c', _AFTER, str(tmp_path)], capture_output=True, text=True, check=True, env=support
    )
    outcome = run.stdout.strip().split(' ', 3)
    assert outcome[:2] == ['indexed', 'replayed']
    assert int(outcome[2]) > 0
    assert outcome[3] == '[]'
