"""The graph that the arguments of a launch file order, and the nodes, processes and mounts in it."""

import re
from pathlib import Path

import pytest

import mount_bringup
from mount_bringup.graph.domain import can_port
from mount_bringup.graph.graph import Graph
from mount_bringup.graph.nodes import (
    DRIVER,
    RECORDER,
    SIMULATED,
    VEHICLE,
    GraphSettings,
    Grouping,
    ending_order,
    groups,
    of_mounts,
)
from mount_bringup.graph.order import launch_order
from mount_bringup.settings import checked_settings
from mount_models.quantity import ParameterError

CONFIG = Path(mount_bringup.__file__).parents[1] / 'config'
MOUNTS = ('left', 'right')
OF_TWO = (
    '/**/mount_control: {ros__parameters: {highest_current: 2.0}}\n'
    '/**/left/mount_control: {ros__parameters: {highest_current: 1.5}}\n'
)


@pytest.fixture
def order(monkeypatch, tmp_path):
    """Return the function that orders a graph; a text with a colon as `config` is written to a file."""
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    monkeypatch.chdir(tmp_path)  # whatever a user has recorded in `bags` is none of the tests'

    def of_arguments(graph, config=None, **given):
        file = CONFIG / f'{graph}.yaml' if config is None else config
        if ': ' in str(file):
            file = tmp_path / 'own.yaml'
            file.write_text(config)
        given = {'config': file, 'recording': 'bags/first', **given}
        return launch_order([graph, *(f'{name}:={text}' for name, text in given.items())])

    return of_arguments


@pytest.fixture
def parameters(order):
    """Return the function that returns the parameters of an ordered graph."""
    return lambda *words, **given: order(*words, **given).settings.parameters


def names(nodes):
    return [node.full_name for node in nodes]


def test_the_shipped_files_order_the_graph_and_its_bus_has_the_port_of_domain_and_namespace(parameters):
    sim = parameters('sim', namespace='/left')
    assert sim['mount_sim']['port'] == sim['mount_driver']['port'] == can_port(7, 'left')
    assert sim['mount_recorder'] == {'uri': 'bags/first'}
    assert sim['mount_control'] == {'continuous_viscous.eigenfrequency': 8.0}
    car = parameters('vehicle')
    assert car['mount_driver']['interface'] == 'socketcan'
    assert 'mount_sim' not in car


def test_arguments_win_over_the_file_and_the_file_over_what_is_not_given(parameters):
    text = (
        '/**/mount_control: {ros__parameters: {eigenfrequency: 9, damper: viscous_3000}}\n'
        '/**/mount_driver: {ros__parameters: {port: 9000}}\n'
        '/**/mount_sim: {ros__parameters: {port: 9000}}\n'
    )
    given = parameters('sim', text, mount='hydro', duration='5', fault='coil_open@8, lost_5@6:2')
    assert repr(given['mount_control']['eigenfrequency']) == '9.0'
    assert given['mount_control']['damper'] == 'viscous_3000'
    assert (given['mount_sim']['port'], given['mount_driver']['port']) == (9000, 9000)
    assert repr(given['mount_sim']['timeline.duration']) == '5.0'
    assert given['mount_sim']['mount'] == 'hydro'
    assert given['mount_sim']['faults'] == ['coil_open@8', 'lost_5@6:2']
    assert parameters('sim', text, recording='2026')['mount_recorder']['uri'] == '2026'


@pytest.mark.parametrize(
    'given', [{'use_sim_time': 'True'}, {'config': '/**: {ros__parameters: {use_sim_time: true}}'}]
)
def test_simulated_time_goes_to_the_nodes_which_warn(parameters, given):
    assert all(values['use_sim_time'] is True for values in parameters('vehicle', **given).values())


def test_a_mount_that_damps_always_takes_its_control_along(parameters):
    assert parameters('sim', mount='friction_always_on')['mount_control']['switching'] == 'always'


def test_without_a_recording_there_is_no_recorder(order):
    without = order('sim', record='false', recording='')
    assert RECORDER not in without.nodes
    assert set(without.settings.parameters) == {'mount_driver', 'mount_sim', 'mount_init', 'mount_control'}


def test_place_and_processes_of_an_order(order):
    car = order('vehicle', composed='true', namespace='right', recording='a:=b').settings
    assert (car.namespace, car.domain, car.grouping) == ('right', 7, Grouping.COMPOSED)
    assert car.parameters['mount_recorder']['uri'] == 'a:=b'


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'mounts': 'left,top'}, "'top' is no place"),
        ({'mount': 'friction_always_on', 'policy': 'continuous_viscous'}, 'needs mount_control.policy'),
        ({'damper': 'viscous_2000', 'policy': 'continuous_viscous'}, 'add policy:=switched_viscous'),
        ({'duration': 'long'}, 'timeline.duration must be a float'),
        ({'restarts': 'x'}, 'restarts:=x must be a number within 0 .. 1000'),
        ({'priority': '-1'}, 'priority:=-1 must be a number within 0 .. 98'),
        ({'config': '/nowhere/none.yaml'}, 'parameter file /nowhere/none.yaml cannot be read'),
        ({'scenary': 'bench'}, "'scenary' is no parameter of sim.launch.py; did you mean scenario"),
        ({'qqq': '1'}, 'known are config'),
        (
            {
                'config': '/**/mount_sim: {ros__parameters: {mount_left.sample_rate: 2000.0}}',
                'mounts': 'left,right',
            },
            "'sample_rate' is common to all mounts: set it without mount_left",
        ),
        (
            {
                'config': '/left/mount_control: {ros__parameters: {sample_rate: 2000.0}}',
                'mounts': 'left,right',
            },
            'mount_control.sample_rate (2000 Hz) must equal mount_driver.sample_rate (1000 Hz); set one',
        ),
    ],
)
def test_what_cannot_be_is_refused_before_a_process_starts(order, given, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        order('sim', **given)


@pytest.mark.parametrize(
    ('command', 'words'),
    [
        (['car'], "graph 'car' is unknown; known are vehicle, sim"),
        (['sim', 'bench'], "'bench' is no parameter of sim.launch.py"),
    ],
)
def test_a_command_that_is_not_written_as_it_must_be_is_refused(command, words):
    with pytest.raises(ParameterError, match=words):
        launch_order(command)


def test_a_simulator_is_no_node_of_the_car(order):
    with pytest.raises(ParameterError, match='is no node of the graph'):
        order('vehicle', '/**/mount_sim: {ros__parameters: {seed: 2}}')


def test_the_can_bus_of_a_vehicle_stands_in_its_file_and_an_argument_wins(parameters):
    text = '/**/mount_driver: {ros__parameters: {interface: kvaser, channel: can3}}'
    driver = parameters('vehicle', text)['mount_driver']
    assert (driver['interface'], driver['channel']) == ('kvaser', 'can3')
    assert parameters('vehicle', text, channel='can4')['mount_driver']['channel'] == 'can4'
    driver = parameters('vehicle', OF_TWO)['mount_driver']
    assert (driver['interface'], driver['channel']) == ('socketcan', 'can0')


def test_each_simulated_mount_has_its_nodes_bus_and_parameters(parameters):
    given = parameters('sim', OF_TWO, mounts='left,right')
    assert list(given) == names(of_mounts(SIMULATED, MOUNTS))
    ports = [given[f'{mount}/mount_driver']['port'] for mount in MOUNTS]
    assert [given['mount_sim'][f'mount_{mount}.port'] for mount in MOUNTS] == ports
    assert ports[0] != ports[1]
    assert given['mount_recorder']['mounts'] == 'left,right'
    assert [given[f'{mount}/mount_control']['highest_current'] for mount in MOUNTS] == [1.5, 2.0]


@pytest.mark.parametrize(
    ('graph', 'config', 'bus'),
    [('vehicle', OF_TWO, 'can0'), ('sim', '/**/mount_driver: {ros__parameters: {port: 9000}}', '9000')],
)
def test_two_mounts_on_one_bus_are_refused(order, graph, config, bus):
    with pytest.raises(ValueError, match=f'the mounts left and right have one CAN bus, {bus}'):
        order(graph, config, mounts='left,right')


def test_a_file_gives_each_mount_in_the_car_its_channel_and_one_of_them_its_own_friction(parameters):
    given = parameters('vehicle', CONFIG / 'two_mounts.yaml', mounts='left,right')
    assert [given[f'{mount}/mount_driver']['channel'] for mount in MOUNTS] == ['can0', 'can1']
    assert 'friction.scale' not in given['left/mount_control']
    assert given['right/mount_control']['friction.scale'] == 0.9
    assert given['mount_recorder']['on_full'] == 'continue'


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
    ended = ['mount_control', 'mount_init', 'mount_driver', 'mount_sim', 'mount_recorder']
    assert names(ending_order(SIMULATED)) == ended
    assert names(ending_order(VEHICLE)) == [name for name in ended if name != 'mount_sim']


def test_topics_that_are_waited_for_are_those_of_the_mount():
    nodes = recorder, left, right = of_mounts((RECORDER, DRIVER), MOUNTS)
    graph = Graph(nodes, GraphSettings(namespace='/car'))
    unmatched = '/car/left/current_setpoint, /car/right/displacement, /car/left/event'
    graph.figures = lambda node: {'unmatched': unmatched}
    assert graph.missing_topics(left) == ['/car/left/current_setpoint']
    assert graph.missing_topics(right) == ['/car/right/displacement']
    assert graph.missing_topics(recorder) == ['/car/left/current_setpoint', '/car/right/displacement']
    graph.figures = lambda node: {}
    assert graph.missing_topics(left) == ['its first diagnostics']


def test_which_nodes_share_a_process():
    assert groups(SIMULATED, Grouping.APART) == [[node] for node in SIMULATED]
    assert groups(SIMULATED, Grouping.TOGETHER) == [[*SIMULATED]]
    composed = [names(group) for group in groups(of_mounts(SIMULATED, MOUNTS), Grouping.COMPOSED)]
    assert ['right/mount_driver', 'right/mount_init', 'right/mount_control'] in composed
    assert len(composed) == 4
