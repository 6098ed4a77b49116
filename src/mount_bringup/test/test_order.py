"""The graph that the arguments of a launch file order."""

from pathlib import Path

import pytest

import mount_bringup
from mount_bringup.graph.domain import can_port
from mount_bringup.graph.launch_arguments import VEHICLE_ARGUMENTS, texts_of
from mount_bringup.graph.nodes import RECORDER
from mount_bringup.graph.order import vehicle_order
from mount_bringup.graph.simulation import SIM_ARGUMENTS, sim_order
from mount_bringup.settings import SettingError
from mount_models.quantity import ParameterError

CONFIG = Path(mount_bringup.__file__).parents[1] / 'config'


@pytest.fixture(autouse=True)
def own_domain(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')


def sim(**given):
    given = {'config': str(CONFIG / 'sim.yaml'), 'recording': 'bags/first', **given}
    defaults = {argument.name: argument.default for argument in SIM_ARGUMENTS}
    return sim_order({**defaults, **given})


def vehicle(**given):
    given = {'config': str(CONFIG / 'vehicle.yaml'), 'recording': 'bags/first', **given}
    defaults = {argument.name: argument.default for argument in VEHICLE_ARGUMENTS}
    return vehicle_order({**defaults, **given})


def test_the_shipped_files_order_the_graph_and_its_bus_has_the_port_of_domain_and_namespace():
    parameters = sim(namespace='/left').settings.parameters
    assert parameters['mount_sim']['port'] == parameters['mount_driver']['port'] == can_port(7, 'left')
    assert parameters['mount_recorder'] == {'uri': 'bags/first'}
    assert parameters['mount_control'] == {'continuous_viscous.eigenfrequency': 8.0}
    car = vehicle().settings.parameters
    assert car['mount_driver']['interface'] == 'socketcan'
    assert 'mount_sim' not in car


def test_arguments_win_over_the_file_and_the_file_over_what_is_not_given(tmp_path):
    file = tmp_path / 'own.yaml'
    file.write_text(
        '/**/mount_control: {ros__parameters: {eigenfrequency: 9, damper: viscous_3000}}\n'
        '/**/mount_driver: {ros__parameters: {port: 9000}}\n'
        '/**/mount_sim: {ros__parameters: {port: 9000}}\n'
    )
    parameters = sim(config=str(file), mount='hydro', port='9001', duration='5').settings.parameters
    assert repr(parameters['mount_control']['eigenfrequency']) == '9.0'
    assert parameters['mount_control']['damper'] == 'viscous_3000'
    assert (parameters['mount_sim']['port'], parameters['mount_driver']['port']) == (9001, 9001)
    assert repr(parameters['mount_sim']['timeline.duration']) == '5.0'
    assert parameters['mount_sim']['mount'] == 'hydro'
    kept = sim(config=str(file)).settings.parameters
    assert (kept['mount_sim']['port'], kept['mount_driver']['port']) == (9000, 9000)


def test_texts_stay_texts():
    assert sim(recording='2026').settings.parameters['mount_recorder']['uri'] == '2026'


def test_faults_are_given_with_commas_between_them_and_checked():
    parameters = sim(fault='coil_open@8, lost_5@6:2').settings.parameters
    assert parameters['mount_sim']['faults'] == ['coil_open@8', 'lost_5@6:2']
    with pytest.raises(ParameterError, match="fault 'fire' is unknown"):
        sim(fault='fire@2')


def test_a_mount_that_damps_always_takes_its_control_along():
    assert sim(mount='friction_always_on').settings.parameters['mount_control']['switching'] == 'always'


def test_without_a_recording_there_is_no_recorder():
    order = sim(record='false', recording='')
    assert RECORDER not in order.nodes
    assert set(order.settings.parameters) == {'mount_driver', 'mount_sim', 'mount_init', 'mount_control'}


def test_scenario_and_duration_of_an_order():
    assert (vehicle().scenario, vehicle().duration) == ('car', float('inf'))
    assert vehicle(duration='30').duration == 30.0
    assert sim(scenario='bench').scenario == 'bench'
    assert (sim().scenario, sim(duration='2').duration) == ('motorway', float('inf'))


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'recording': ''}, 'a recording needs a folder'),
        ({'policy': 'best'}, "policy 'best' is unknown"),
        ({'mount': 'rubber'}, "mount 'rubber' is unknown"),
        ({'scenario': 'race'}, "scenario 'race' is unknown"),
        ({'damper': 'soft', 'policy': 'switched_viscous'}, "'soft'"),
        ({'damper': 'viscous_2000', 'policy': 'continuous_viscous'}, 'add policy:=switched_viscous'),
        ({'port': '['}, r'^port:=\[ is not valid YAML'),
        ({'duration': 'long'}, 'timeline.duration must be a float'),
        ({'port': '80'}, r'port \(80 1\) must lie within 1024'),
        ({'priority': '-1'}, r'priority:=-1 must be a number within 0 \.\. 98'),
        ({'parameters_file': 'none.yaml'}, 'none.yaml'),
        ({'config': 'none.yaml'}, 'none.yaml cannot be read'),
    ],
)
def test_what_cannot_be_is_refused_before_a_process_starts(given, words):
    with pytest.raises(ValueError, match=words):
        sim(**given)


def test_a_simulator_is_no_node_of_the_car(tmp_path):
    file = tmp_path / 'own.yaml'
    file.write_text('/**/mount_sim: {ros__parameters: {seed: 2}}')
    with pytest.raises(ParameterError, match='is no node of the graph'):
        vehicle(config=str(file))


def test_the_can_bus_of_a_vehicle_stands_in_its_file_and_an_argument_wins(tmp_path):
    file = tmp_path / 'own.yaml'
    file.write_text('/**/mount_driver: {ros__parameters: {interface: kvaser, channel: can3}}')
    driver = vehicle(config=str(file)).settings.parameters['mount_driver']
    assert (driver['interface'], driver['channel']) == ('kvaser', 'can3')
    assert vehicle(config=str(file), channel='can4').settings.parameters['mount_driver']['channel'] == 'can4'
    file.write_text('/**/mount_control: {ros__parameters: {highest_current: 2.0}}')
    driver = vehicle(config=str(file)).settings.parameters['mount_driver']
    assert (driver['interface'], driver['channel']) == ('socketcan', 'can0')


def test_a_missing_config_file_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r'parameter file .*/none.yaml'):
        sim(config=str(tmp_path / 'none.yaml'))


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        (
            '/**/mount_sim: {ros__parameters: {mount_left.sample_rate: 2000.0}}',
            "'sample_rate' is common to all mounts: set it without mount_left",
        ),
        (
            '/left/mount_control: {ros__parameters: {sample_rate: 2000.0}}',
            r'mount_control.sample_rate \(2000 Hz\) must equal mount_driver.sample_rate \(1000 Hz\); set one',
        ),
    ],
)
def test_a_sample_rate_of_one_mount_alone_is_refused(tmp_path, text, sentence):
    file = tmp_path / 'own.yaml'
    file.write_text(text)
    with pytest.raises(ParameterError, match=sentence):
        sim(config=str(file), mounts='left,right')


def test_an_existing_folder_is_refused_before_anything_starts(tmp_path):
    sim(recording=str(tmp_path / 'new'))
    sim(record='false', recording=str(tmp_path))
    with pytest.raises(SettingError, match=r'exists already; a recording is never written over'):
        vehicle(recording=str(tmp_path))


@pytest.mark.parametrize(
    ('word', 'remedy'),
    [
        ('scenary:=bench', r'did you mean scenario:=\?'),
        ('qqq:=1', 'known are config'),
        ('bench', 'is no argu'),
    ],
)
def test_an_argument_that_the_launch_file_does_not_have_is_refused(word, remedy):
    assert texts_of(['scenario:=bench', 'fault:=a:=b'], SIM_ARGUMENTS)['fault'] == 'a:=b'
    with pytest.raises(SettingError, match=remedy):
        texts_of(['scenario:=bench', word], SIM_ARGUMENTS)
