"""What the launch files hand to `launch`, which is not needed here: the test stands in for it."""

import importlib
import os
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
import yaml

import mount_bringup
from mount_bringup.graph import domain
from mount_bringup.graph.domain import DomainError

PACKAGE = Path(mount_bringup.__file__).parents[1]
MODULES = ('launch', 'launch.actions', 'launch.event_handlers', 'launch.events', 'launch.events.process',
           'launch.logging', 'launch_ros', 'launch_ros.actions')  # fmt: skip


class Launched:
    """A launch file that was run: what it declared, started, and does when a process ends."""

    def __init__(self, launch, name, **given):
        for stand_in in (
            launch.DeclareLaunchArgument,
            launch.OpaqueFunction,
            launch.Node,
            launch.OnProcessExit,
        ):
            stand_in.reset_mock()
        arguments = {}
        exec((PACKAGE / 'launch' / f'{name}.launch.py').read_text(), arguments)
        arguments['generate_launch_description']()
        self.declared = {call.args[0]: call.kwargs for call in launch.DeclareLaunchArgument.call_args_list}
        texts = {name: declared['default_value'] for name, declared in self.declared.items()}
        self._context = SimpleNamespace(launch_configurations={**texts, **given}, is_shutdown=False)
        launch.OpaqueFunction.call_args.kwargs['function'](self._context)
        self.processes = {call.kwargs['executable']: call.kwargs for call in launch.Node.call_args_list}
        handlers = [call.kwargs['on_exit'] for call in launch.OnProcessExit.call_args_list]
        self._ended = dict(zip(self.processes, handlers, strict=True))

    def end(self, name, code):
        return self._ended[name](SimpleNamespace(returncode=code), self._context)

    def end_all(self):
        self._context.is_shutdown = True
        for name in self.processes:
            self.end(name, 0)


@pytest.fixture
def launch(monkeypatch):
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, MagicMock())
    monkeypatch.delitem(sys.modules, 'mount_bringup.graph.launch', raising=False)
    module = importlib.import_module('mount_bringup.graph.launch')
    monkeypatch.setattr(module, 'get_package_share_directory', lambda _: str(PACKAGE))
    monkeypatch.setattr(domain, '_PLACE', f'\0engine_mount_test_{os.getpid()}')
    monkeypatch.setenv('ROS_DOMAIN_ID', '5')
    yield module
    sys.modules.pop('mount_bringup.graph.launch')


REPLAYED = str(Path(__file__).resolve().parents[3] / 'bags' / 'reference' / 'gap')


@pytest.mark.parametrize('given', [{'name': 'sim'}, {'name': 'vehicle'}, {'name': 'replay', 'bag': REPLAYED}])
def test_every_argument_has_a_description(launch, given):
    launched = Launched(launch, recording='bags/first', **given)
    assert all(declared['description'] for declared in launched.declared.values())
    assert {'namespace', 'config', 'record', 'recording', 'policy', 'priority', 'log_level'} < set(
        launched.declared
    )
    launched.end_all()


@pytest.mark.parametrize('name', ['sim', 'vehicle'])
def test_the_graph_takes_the_common_arguments(launch, name):
    launched = Launched(launch, name, recording='bags/first')
    assert {
        'namespace', 'config', 'record', 'recording', 'policy', 'damper', 'parameters_file', 'specimen',
        'port', 'duration', 'priority', 'composed', 'restarts', 'log_level',
    } < set(launched.declared)  # fmt: skip
    launched.end_all()


def test_nodes_and_their_supervisor_end_with_launch_and_run_at_the_priority_asked_for(launch):
    launched = Launched(launch, 'sim', recording='bags/first', namespace='left', priority='10')
    assert list(launched.processes) == [
        'mount_recorder', 'mount_driver', 'mount_sim', 'mount_init', 'mount_control', 'mount_supervisor',
    ]  # fmt: skip
    told = {name: process['additional_env'] for name, process in launched.processes.items()}
    assert len({environment['ENGINE_MOUNT_STARTER'] for environment in told.values()}) == 1
    priorities = {name: environment['ENGINE_MOUNT_PRIORITY'] for name, environment in told.items()}
    assert priorities == {
        'mount_recorder': '5', 'mount_driver': '10', 'mount_sim': '10', 'mount_init': '10',
        'mount_control': '10', 'mount_supervisor': '0',
    }  # fmt: skip
    launched.end_all()


def test_the_real_time_priority_that_launch_runs_at_is_the_loops_and_not_that_of_the_start(
    launch, monkeypatch
):
    monkeypatch.setattr(launch, 'drop_real_time', lambda: 20)
    launched = Launched(launch, 'sim', recording='bags/first', namespace='left')
    told = {name: process['additional_env'] for name, process in launched.processes.items()}
    assert told['mount_control']['ENGINE_MOUNT_PRIORITY'] == '20'
    assert told['mount_recorder']['ENGINE_MOUNT_PRIORITY'] == '10'
    assert 'priority 20, now ordinary' in launch.LogInfo.call_args.kwargs['msg']
    launched.end_all()


def test_a_second_launch_in_the_namespace_is_refused_until_the_last_process_of_the_first_has_ended(launch):
    first = Launched(launch, 'sim', recording='bags/first', namespace='left')
    other = Launched(launch, 'vehicle', recording='bags/first', namespace='right')
    with pytest.raises(DomainError, match='already runs in ROS domain 5, namespace /left'):
        Launched(launch, 'vehicle', recording='bags/second', namespace='/left')
    assert not launch.Node.called  # nothing that could configure a node of the first
    first.end_all()
    Launched(launch, 'vehicle', recording='bags/second', namespace='/left').end_all()
    other.end_all()


def test_the_end_of_the_simulated_electronics_ends_launch_as_a_failure_that_names_them(launch):
    launched = Launched(launch, 'sim', recording='bags/first')
    assert not launched.processes['mount_sim']['respawn']
    with pytest.raises(RuntimeError, match='mount_sim ended with code -9'):
        launched.end('mount_sim', -9)
    launched.end_all()


def test_a_node_that_ends_by_itself_is_respawned_and_its_supervisor_is_told_how_often(launch):
    launched = Launched(launch, 'sim', recording='bags/first', restarts='2')
    assert launched.processes['mount_control']['respawn']
    assert launched.end('mount_control', -9) is None
    assert '--restart-limit=2' in launched.processes['mount_supervisor']['arguments']
    assert 'respawn' not in launched.processes['mount_supervisor']
    launched.end_all()


def test_without_restarts_the_end_of_a_node_ends_launch(launch):
    launched = Launched(launch, 'sim', recording='bags/first', restarts='0')
    with pytest.raises(RuntimeError, match='mount_control ended with code -9'):
        launched.end('mount_control', -9)
    launched.end_all()


def test_composed_nodes_share_a_process_with_the_parameters_of_each_until_all_have_ended(launch):
    launched = Launched(launch, 'sim', recording='bags/first', composed='true', policy='continuous_viscous')
    assert list(launched.processes) == ['mount_recorder', 'mount_composed', 'mount_sim', 'mount_supervisor']
    process = launched.processes['mount_composed']
    assert 'name' not in process  # it would rename all three
    assert process['additional_env']['ENGINE_MOUNT_NODES'] == 'mount_driver mount_init mount_control'
    [file] = map(Path, process['parameters'])
    parameters = yaml.safe_load(file.read_text())
    assert [*parameters] == ['/**/mount_control', '/**/mount_driver', '/**/mount_init']
    assert parameters['/**/mount_control']['ros__parameters']['policy'] == 'continuous_viscous'
    assert '--grouping=COMPOSED' in launched.processes['mount_supervisor']['arguments']
    assert launched.end('mount_composed', -9) is None
    launched.end_all()
    assert not file.exists()


@pytest.mark.parametrize('name', ['sim', 'vehicle'])
def test_a_missing_config_file_is_refused_before_a_process_starts(launch, name):
    with pytest.raises(ValueError, match=r'parameter file /nowhere/car.yaml'):
        Launched(launch, name, record='false', config='/nowhere/car.yaml')
    assert not launch.Node.called


def test_a_replay_starts_the_control_and_a_supervisor_that_plays_and_whose_end_is_the_end(launch):
    launched = Launched(launch, 'replay', bag=REPLAYED, record='false')
    assert list(launched.processes) == ['mount_control', 'mount_supervisor']
    assert not launched.processes['mount_control']['respawn']
    assert f'--bag={REPLAYED}' in launched.processes['mount_supervisor']['arguments']
    assert launched.end('mount_supervisor', 0) is launch.EmitEvent.return_value
    launched.end_all()


def test_the_end_of_a_drive_ends_launch_as_a_success(launch):
    launched = Launched(launch, 'sim', recording='bags/first')
    assert launched.end('mount_supervisor', 0) is launch.EmitEvent.return_value
    launched.end_all()
