"""What the launch files hand to `launch`, which is not needed here: the test stands in for it."""

import importlib
import os
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

import mount_bringup
from mount_bringup.graph.order import GRAPHS, arguments_of

PACKAGE = Path(mount_bringup.__file__).parents[1]
MODULES = ('launch', 'launch.actions', 'launch.events', 'launch.events.process', 'launch.logging')


class Launched:
    """A launch file that was run: what it declared, and the process that it started."""

    def __init__(self, launch, name, **given):
        launch.DeclareLaunchArgument.reset_mock()
        launch.ExecuteProcess.reset_mock()
        scope = {}
        exec((PACKAGE / 'launch' / f'{name}.launch.py').read_text(), scope)
        scope['generate_launch_description']()
        self.declared = {call.args[0]: call.kwargs for call in launch.DeclareLaunchArgument.call_args_list}
        texts = {name: declared['default_value'] for name, declared in self.declared.items()}
        context = SimpleNamespace(launch_configurations={**texts, **given})
        launch.OpaqueFunction.call_args.kwargs['function'](context)
        [process] = launch.ExecuteProcess.call_args_list
        self.process = process.kwargs
        self.command = process.kwargs['cmd']


@pytest.fixture
def launch(monkeypatch):
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, MagicMock())
    monkeypatch.delitem(sys.modules, 'mount_bringup.graph.launch', raising=False)
    module = importlib.import_module('mount_bringup.graph.launch')
    monkeypatch.setattr(module, 'get_package_share_directory', lambda _: str(PACKAGE))
    monkeypatch.setenv('ROS_DOMAIN_ID', '5')
    yield module
    sys.modules.pop('mount_bringup.graph.launch')


@pytest.mark.parametrize('name', GRAPHS)
def test_every_argument_has_a_description_and_goes_to_the_supervisor(launch, name):
    launched = Launched(launch, name, recording='bags/none')
    assert all(declared['description'] for declared in launched.declared.values())
    assert Path(launched.declared['config']['default_value']) == PACKAGE / 'config' / f'{name}.yaml'
    program, *words = launched.command[2:]
    assert 'from mount_bringup.graph.run import main' in program
    assert words[0] == name
    assert [word.partition(':=')[0] for word in words[1:]] == [each.name for each in arguments_of(name)]
    assert 'recording:=bags/none' in words


def test_the_supervisor_ends_with_launch_and_is_not_killed_while_a_recorder_writes(launch):
    process = Launched(launch, 'sim', recording='bags/none').process
    assert process['additional_env']['ENGINE_MOUNT_STARTER'] == str(os.getpid())
    assert min(float(process[name]) for name in ('sigterm_timeout', 'sigkill_timeout')) >= 3600.0


def test_launch_ends_as_the_supervisor_does(launch):
    on_exit = Launched(launch, 'sim', recording='bags/none').process['on_exit']
    for code in (0, -2):
        assert on_exit(SimpleNamespace(returncode=code), None) is launch.EmitEvent.return_value
    for code, reason in ((1, ', for the reason'), (-9, '$')):
        with pytest.raises(RuntimeError, match=f'mount_supervisor ended with code {code}{reason}'):
            on_exit(SimpleNamespace(returncode=code), None)


def test_an_unknown_argument_is_refused_but_not_where_another_launch_file_includes_ours(launch, monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'mount_bringup', 'vehicle.launch.py', 'chanel:=can1'])
    with pytest.raises(ValueError, match='did you mean channel'):
        Launched(launch, 'vehicle', record='false')
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'car', 'car.launch.py', 'chanel:=can1'])
    Launched(launch, 'vehicle', record='false')
