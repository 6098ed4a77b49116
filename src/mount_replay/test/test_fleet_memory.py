"""A fleet's worker may take 400 MB: how much more it holds of a recording that is longer."""

import tracemalloc
from types import SimpleNamespace

import pytest

from engine_mount.recordings.audit import latency
from engine_mount.recordings.bag import column_parts
from engine_mount.recordings.messages import packed_column, stamps
from engine_mount.recordings.run.place import open_run
from mount_recorder.session import session_text
from mount_replay.fleet.catalogue import in_bands
from mount_replay.fleet.catalogue.figures import lost_figures, state_figures
from mount_replay.fleet.what_if.compared import compared_setpoints, recorded_in
from mount_replay.given import stretches
from mount_replay.loop.recording import record_core
from mount_replay.replay import parsed_changes

SHORT, LONG = 3.0, 13.0  # s
SAMPLES = 1000 * (LONG - SHORT)
CHANGES = parsed_changes({'highest_current': 0.7})
AT_ONCE = 512  # of what is looked at together: little beside such short drives


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    """A short and a long drive, with all topics of the simulator."""
    folder = tmp_path_factory.mktemp('drives')
    for name, duration in (('short', SHORT), ('long', LONG)):
        parameters = {'mount_sim': {'scenario': 'motorway', 'timeline.duration': duration}}
        record_core(folder / name, parameters, session_text({'parameters': parameters}))
    return folder / 'short', folder / 'long'


@pytest.fixture(autouse=True)
def _in_small_parts(monkeypatch):
    for module, name in (
        *((packed_column, 'BLOCK'), (packed_column, '_SLAB'), (stamps, '_AT_ONCE'), (in_bands, '_PIECE')),
        *((latency, '_PLACES'), (stretches, '_READ_AT_ONCE')),
    ):
        monkeypatch.setattr(module, name, AT_ONCE)
    monkeypatch.setattr(column_parts.column_parts, '__defaults__', (AT_ONCE,))
    # `tracemalloc` sees no mapping
    monkeypatch.setattr(
        packed_column, 'mmap', SimpleNamespace(MAP_PRIVATE=0, mmap=lambda _, size, flags: bytearray(size))
    )


def held_more(drives, look):
    """Return how many bytes `look` holds more at its peak for each further sample."""
    peaks = []
    for drive in (drives[1], *drives):  # the first time modules and laws are loaded too
        recording = open_run(drive)
        tracemalloc.start()
        look(recording)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    return (peaks[2] - peaks[1]) / SAMPLES


def test_a_row_of_the_catalogue_holds_few_bytes_of_each_sample(drives):
    def look(recording):
        state_figures(recording, lost_figures(recording)[1])

    assert held_more(drives, look) < 9.0


def test_a_replay_holds_nothing_of_each_sample(drives):
    def look(recording):
        compared_setpoints(recorded_in(recording), CHANGES, AT_ONCE)

    assert held_more(drives, look) < 2.0
