"""Measured roads from the command line: Belgian blocks, driven by the whole vehicle."""

import shutil

import numpy as np
import pytest
import yaml
from command_line import command, refused

from engine_mount.recordings.recording import open_recording, recording_hash
from engine_mount.recordings.session import recorded_session
from mount_sim.excitation.road import RandomRoad, random_road

pytestmark = pytest.mark.slow

STONE = 0.16  # m


def stones(places, seed):
    """Heights (n,) in m of rounded stones of `STONE` m on a road of class B."""
    tops = np.random.default_rng(seed).normal(0.0, 0.003, int(places[-1] / STONE) + 2)
    arch = 0.008 * (np.sin(np.pi * places / STONE) ** 2) ** 0.25
    ground = random_road(places / 10.0, RandomRoad(64e-6, 2.0, 0.01, 3.0, 10.0, 0.0, 4))
    return ground + tops[(places / STONE).astype(int)] + arch


@pytest.fixture(scope='module')
def blocks(tmp_path_factory):
    """A table of Belgian blocks, 110 m."""
    places = np.arange(0.0, 110.0, 0.01)
    file = tmp_path_factory.mktemp('roads') / 'blocks.csv'
    columns = np.c_[places, stones(places, 2)]
    np.savetxt(file, columns, delimiter=',', header='distance [m],height [m]', comments='')
    return file


def truth(folder, name):
    return np.asarray(open_recording(folder / 'recording')['/sim/truth'][name])


def test_a_drive_over_a_road_tells_its_origin_and_can_be_moved(blocks, tmp_path):
    options = ('--speed', '30/3.6', '--core', '--no-report', '--duration', 4, '--out', tmp_path / 'run')
    command('drive', '--road', blocks, *options)
    session = yaml.safe_load(recorded_session(open_recording(tmp_path / 'run' / 'recording')))
    given = session['given']['road.file']
    told = (given['file'], given['format'], given['speed'])
    assert told == ('blocks.csv', 'text table', '8.333 m/s (30 km/h)')
    assert given['sha256'] == recording_hash(blocks)
    read = tmp_path / 'run' / given['read']['file']
    assert session['parameters']['mount_sim']['road.file'] == str(read)
    assert given['read']['sha256'] == recording_hash(read)
    shutil.rmtree(tmp_path / 'run' / 'given')  # the recording tells its road, wherever the file is
    (tmp_path / 'run').rename(tmp_path / 'moved')
    command('audit', tmp_path / 'moved')
    command('replay', tmp_path / 'moved', '--out', tmp_path / 'again')  # code 0: the setpoints are equal
    command('report', tmp_path / 'moved')


def test_the_road_behind_a_recorded_acceleration_moves_the_engine_alike(blocks, tmp_path):
    quick = ('--speed', '60/3.6', '--mount', 'elastomer', '--core', '--no-report', '--out')
    command('drive', '--road', blocks, *quick, tmp_path / 'first')
    words = ('--column', '/sim/chassis_acceleration.linear_acceleration.z', '--speed', '60/3.6')
    command('road', 'invert', tmp_path / 'first' / 'recording', *words, '--out', tmp_path / 'road.csv')
    command('drive', '--road', tmp_path / 'road.csv', *quick, tmp_path / 'again')
    first, again = (truth(tmp_path / run, 'displacement') for run in ('first', 'again'))
    again = again[5000:]  # the recording began with 5 s of rest, and so does its road
    moved = slice(7000, min(first.size, again.size) - 500)
    error = np.sqrt(np.mean((again[moved] - first[moved]) ** 2) / np.mean(first[moved] ** 2))
    assert error < 0.1


@pytest.mark.parametrize(
    ('words', 'sentence'),
    [
        ('--speed 120', 'is it in km/h? Write 120/3.6'),
        ('--speed 20 --scenario bench', 'or the file'),
    ],
)
def test_what_is_no_road_is_refused_before_anything_is_driven(blocks, words, sentence):
    assert sentence in refused('drive', '--road', blocks, '--core', *words.split())
