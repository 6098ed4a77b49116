"""What needs no running graph works without ROS and a bus: drives in core, replays, audits, reports."""

import json
import subprocess
import sys

import pytest

HIDDEN = """
import importlib.util, json, sys, time

class Hidden:
    packages = {'rclpy', 'rpyutils', 'launch', 'ament_index_python', 'rcl_interfaces', 'lifecycle_msgs'}
    packages |= {'e2e'}  # the protection of frames on the bus
    packages |= {'std_msgs', 'sensor_msgs', 'geometry_msgs', 'diagnostic_msgs', 'std_srvs'}

    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in self.packages:
            raise ModuleNotFoundError(f'{name} is hidden', name=name)

find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name in Hidden.packages else find_spec(name, *more)
sys.meta_path.insert(0, Hidden())
"""
WORK = """
import engine_mount
driven = engine_mount.drive(core=True, scenario='bench', duration=2.0, out='drive')
recording = engine_mount.open(driven.recording)
replayed = engine_mount.replay(driven.recording)
stiff = engine_mount.replay(driven.recording, {'continuous_viscous.damping_coefficient': 3500.0}, out='stiff')
print(json.dumps({
    'samples': len(recording['displacement']),
    'table': recording.latched('current_force_table').data[0],
    'held': replayed.held,
    'sound': engine_mount.audit('drive').sound,
    'equal': engine_mount.compare('drive', 'stiff').equal,
    'page': len(engine_mount.report('drive').html),
}))
"""
COMMAND = """
from engine_mount.cli.command import main
main(sys.argv[1:])
"""


@pytest.fixture
def process_without_ros(tmp_path):
    def run(code, *arguments):
        return subprocess.run(
            [sys.executable, '-P', '-c', HIDDEN + code, *arguments],
            cwd=tmp_path, capture_output=True, text=True,
        )  # fmt: skip

    return run


@pytest.fixture
def without_ros(process_without_ros):
    def run(code):
        done = process_without_ros(code)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run


def test_a_desk_without_ros_drives_replays_audits_and_reports(without_ros):
    found = without_ros(WORK)
    assert (found['samples'], found['held'], found['sound'], found['equal']) == (7000, True, True, False)
    assert found['table'] > 0.0
    assert found['page'] > 10_000


def test_the_command_drives_in_core_and_refuses_a_graph_before_it_writes(process_without_ros, tmp_path):
    options = ('drive', '--scenario', 'bench', '--duration', '0.1', '--out')
    graph = process_without_ros(COMMAND, *options, 'graph')
    assert graph.returncode == 2
    assert 'needs ROS 2 (rclpy), which is not installed' in graph.stderr
    assert not (tmp_path / 'graph').exists()
    core = process_without_ros(COMMAND, *options, 'core', '--core')
    assert core.returncode == 0, core.stderr


def test_importing_the_desk_loads_nothing_heavy(without_ros):
    loaded = without_ros('import engine_mount; print(json.dumps(sorted(sys.modules)))')
    assert not {'numpy', 'scipy', 'numba', 'pyarrow', 'matplotlib', 'rosbags', 'mcap'} & {*loaded}
    for name in ('drive', 'replay', 'audit', 'compare', 'report', 'road', 'experiment'):
        assert without_ros(f'import engine_mount; print(json.dumps(callable(engine_mount.{name})))')
