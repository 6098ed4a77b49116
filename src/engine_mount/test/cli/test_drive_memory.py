"""A long drive is evaluated and reported in the memory of what is shown of it."""

import tracemalloc

import pytest
from typer.testing import CliRunner

from engine_mount.cli.command import app
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.preflight import preflight
from engine_mount.recordings.recording import Recording
from mount_ros.topics import TOPICS

STREAMS = {f'/{topic.name}' for topic in TOPICS if topic.rate >= 1000.0}


@pytest.mark.parametrize('report', ['--no-report', '--report'])
def test_no_stream_of_a_drive_is_held_whole(tmp_path, monkeypatch, report):
    read = Recording._load

    def load(self, names):
        assert not STREAMS & set(names)
        return read(self, names)

    monkeypatch.setattr(Recording, '_load', load)
    options = ['--core', '--scenario', 'bench', '--duration', '0.6', '--set', 'mount_sim.timeline.start=2.8']
    result = CliRunner().invoke(app, ['drive', *options, report, '--out', str(tmp_path / 'run')])
    assert result.exit_code == 0, result.output


def peak_of_core(folder, duration):
    parameters = {'mount_sim': {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': duration}}
    excitation = preflight(parameters)
    tracemalloc.start()
    outcome = record_core(folder, parameters, 'session', excitation=excitation)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return outcome.samples, peak


def test_a_drive_is_recorded_in_blocks_of_fixed_size(tmp_path):
    peak_of_core(tmp_path / 'warm', 0.5)  # compiles, and loads what is loaded once
    (short, before), (long, after) = (peak_of_core(tmp_path / f'{each}', each) for each in (2.0, 8.0))
    assert (after - before) / (long - short) < 40  # bytes of a sample: the index of the recording
