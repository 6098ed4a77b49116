"""A long drive is evaluated and reported in the memory of what is shown of it."""

import pytest
from typer.testing import CliRunner

from mount_bags.reading import Recording
from mount_bringup.command import app
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
