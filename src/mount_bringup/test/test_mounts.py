"""The mounts of a car: what holds for each, nodes in namespaces, launch arguments."""

from pathlib import Path

import pytest

import mount_bringup
from mount_bringup.graph.graph import Graph
from mount_bringup.graph.launch_arguments import VEHICLE_ARGUMENTS
from mount_bringup.graph.nodes import (
    DRIVER,
    RECORDER,
    SIMULATED,
    GraphSettings,
    Grouping,
    ending_order,
    groups,
    of_mounts,
)
from mount_bringup.graph.order import vehicle_order
from mount_bringup.graph.simulation import SIM_ARGUMENTS, sim_order
from mount_bringup.mounts import mounts_of, settings_of_mount, settings_of_mounts
from mount_bringup.settings import checked_settings
from mount_models.quantity import ParameterError

MOUNTS = ('left', 'right')
SETTINGS = {
    'mount_sim': {'mounts': 'left,right', 'friction.scale': 1.1, 'mount_left.friction.scale': 1.2},
    'mount_control': {'highest_current': 2.0, 'longest_bridge': 3},
    'left/mount_control': {'highest_current': 1.0},
}

EXAMPLE = Path(mount_bringup.__file__).parents[1] / 'config' / 'two_mounts.yaml'


def names(nodes):
    return [node.full_name for node in nodes]


def test_own_settings_of_a_mount_come_before_those_of_all():
    assert mounts_of(SETTINGS) == MOUNTS
    left, right = settings_of_mounts(SETTINGS).values()
    assert left['mount_control'] == {'highest_current': 1.0, 'longest_bridge': 3}
    assert right['mount_control'] == SETTINGS['mount_control']
    assert (left['mount_sim']['friction.scale'], right['mount_sim']['friction.scale']) == (1.2, 1.1)


def test_one_mount_alone_has_the_settings_as_they_are():
    settings = {'mount_sim': {'seed': 2}, 'mount_control': {'policy': 'switched_viscous'}}
    assert settings_of_mounts(settings) == {'': settings}
    assert settings_of_mount(settings, '') == settings
    with pytest.raises(ParameterError, match='its mounts are one alone'):
        mounts_of({'left/mount_control': {}})


def test_settings_of_one_mount_are_typed_and_checked_as_those_of_all():
    checked = checked_settings(
        {'mount_sim': {'mount_left.friction.scale': 1}, 'left/mount_driver': {'port': 2000}}
    )
    assert checked == {'mount_sim': {'mount_left.friction.scale': 1.0}, 'left/mount_driver': {'port': 2000}}
    for wrong in ({'left/mount_sim': {}}, {'mount_sim': {'mount_left.frictoin.scale': 1.0}}):
        with pytest.raises(ParameterError):
            checked_settings(wrong)


def test_nodes_of_each_mount_start_side_by_side_and_end_before_the_electronics():
    nodes = of_mounts(SIMULATED, MOUNTS)
    assert names(nodes) == [
        'mount_recorder',
        *('left/mount_driver', 'right/mount_driver', 'mount_sim'),
        *('left/mount_init', 'right/mount_init', 'left/mount_control', 'right/mount_control'),
    ]
    assert names(ending_order(nodes))[-3:] == ['left/mount_driver', 'mount_sim', 'mount_recorder']
    assert of_mounts(SIMULATED, ()) == SIMULATED
    composed = [names(group) for group in groups(nodes, Grouping.COMPOSED)]
    assert ['right/mount_driver', 'right/mount_init', 'right/mount_control'] in composed
    assert len(composed) == 4


def test_topics_that_are_waited_for_are_those_of_the_mount(monkeypatch):
    nodes = recorder, left, right = of_mounts((RECORDER, DRIVER), MOUNTS)
    graph = Graph(nodes, GraphSettings(namespace='/car'))
    unmatched = '/car/left/current_setpoint, /car/right/displacement, /car/left/event'
    monkeypatch.setattr(graph, 'figures', lambda node: {'unmatched': unmatched})
    assert graph.missing_topics(left) == ['current_setpoint']
    assert graph.missing_topics(right) == ['displacement']
    assert graph.missing_topics(recorder) == ['left/current_setpoint', 'right/displacement']
    monkeypatch.setattr(graph, 'figures', lambda node: {})
    assert graph.missing_topics(left) == ['its first diagnostics']


def given(arguments, tmp_path, **texts):
    config = tmp_path / 'config.yaml'
    config.write_text(
        '/**/mount_control: {ros__parameters: {highest_current: 2.0}}\n'
        '/**/left/mount_control: {ros__parameters: {highest_current: 1.5}}\n'
    )
    defaults = {argument.name: argument.default for argument in arguments}
    return {**defaults, 'config': str(config), 'recording': 'bags/car', 'mounts': 'left,right', **texts}


def test_launch_gives_each_mount_its_nodes_bus_and_parameters(tmp_path):
    order = sim_order(given(SIM_ARGUMENTS, tmp_path))
    parameters = order.settings.parameters
    assert list(parameters) == names(of_mounts(SIMULATED, MOUNTS))
    ports = [parameters[f'{mount}/mount_driver']['port'] for mount in MOUNTS]
    assert [parameters['mount_sim'][f'mount_{mount}.port'] for mount in MOUNTS] == ports
    assert ports[0] != ports[1]
    assert parameters['mount_recorder']['mounts'] == 'left,right'
    assert parameters['left/mount_control']['highest_current'] == 1.5
    assert parameters['right/mount_control']['highest_current'] == 2.0


def test_launch_in_the_car_gives_each_mount_its_channel(tmp_path):
    arguments = given(VEHICLE_ARGUMENTS, tmp_path, channels='can0, can1')
    parameters = vehicle_order(arguments).settings.parameters
    assert [parameters[f'{mount}/mount_driver']['channel'] for mount in MOUNTS] == ['can0', 'can1']
    with pytest.raises(ValueError, match='the mounts left and right have one CAN bus, can0'):
        vehicle_order(given(VEHICLE_ARGUMENTS, tmp_path))
    for channels in ('can0', 'can0,can0'):
        with pytest.raises(ValueError, match='must name a channel for each of the mounts'):
            vehicle_order(given(VEHICLE_ARGUMENTS, tmp_path, channels=channels))


def test_a_file_gives_each_mount_in_the_car_its_channel_and_one_of_them_its_own_friction(tmp_path):
    arguments = {**given(VEHICLE_ARGUMENTS, tmp_path), 'config': str(EXAMPLE)}
    parameters = vehicle_order(arguments).settings.parameters
    assert [parameters[f'{mount}/mount_driver']['channel'] for mount in ('left', 'right')] == ['can0', 'can1']
    assert 'friction.scale' not in parameters['left/mount_control']
    assert parameters['right/mount_control']['friction.scale'] == 0.9
    assert parameters['mount_recorder']['on_full'] == 'continue'
