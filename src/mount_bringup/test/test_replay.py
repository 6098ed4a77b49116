"""The control and the player that the arguments of replay.launch.py order."""

import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import yaml
from ros_testing import LIMIT, wait_until

import mount_models
from mount_bringup.graph.nodes import GraphError
from mount_bringup.graph.player import PLAYED, Player, offers_text, play_command
from mount_bringup.graph.replay import REPLAY_ARGUMENTS, replay_order
from mount_models.quantity import ParameterError
from mount_recorder.bag_writer import BagWriter
from mount_recorder.session import session_message, session_text
from mount_ros.topics import SESSION

RECORDED = {'quality': 0.7, 'friction.scale': 0.8, 'parameters_file': 'gone.yaml', 'of_yesterday': 1}


@pytest.fixture(autouse=True)
def own_domain(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')


@pytest.fixture
def record(tmp_path):
    """Return the function that records the topics of each mount, one message each, and its session."""

    def write(*mounts, without=''):
        writer = BagWriter(tmp_path / 'drive' / 'recording')
        text = session_text({'parameters': {'mount_control': RECORDED}})
        for mount in mounts:
            space = f'/{mount}'.rstrip('/')
            for topic in (*PLAYED, SESSION):
                if topic.name != without:
                    writer.add_topic(f'{space}/{topic.name}', topic.type)
                    raw = session_message(text) if topic is SESSION else bytes(8)
                    writer.write(f'{space}/{topic.name}', raw, 1)
        writer.close()
        return tmp_path / 'drive'

    return write


def ordered(bag, **given):
    texts = {argument.name: argument.default for argument in REPLAY_ARGUMENTS}
    return replay_order({**texts, 'bag': str(bag), 'record': 'false', **given})


def test_the_control_has_the_recorded_parameters_and_what_is_given_wins(record, tmp_path):
    bag = record('')
    file = tmp_path / 'own.yaml'
    file.write_text('/**/mount_control: {ros__parameters: {quality: 0.9, lead_time: 0.001}}')
    assert ordered(bag).settings.parameters == {
        'mount_control': {'policy': 'switched_viscous', 'quality': 0.7, 'friction.scale': 0.8}
    }
    control = ordered(bag, config=str(file), damper='viscous_3000').settings.parameters['mount_control']
    assert (control['quality'], control['lead_time']) == (0.9, 0.001)
    assert 'damper' in control


def test_with_another_specimen_file_the_recorded_friction_is_not_used(record):
    file = str(Path(mount_models.__file__).parent / 'specimens' / 'default.yaml')
    control = ordered(record(''), parameters_file=file).settings.parameters['mount_control']
    assert control['parameters_file'] == file
    assert 'friction.scale' not in control


def test_a_replay_lives_where_its_mount_was_recorded(record):
    order = ordered(record('left', 'right'), namespace='/right', record='true', recording='again', rate='0.5')
    assert order.settings.namespace == 'right'
    assert [node.name for node in order.nodes] == ['mount_recorder', 'mount_control']
    assert order.settings.parameters['mount_recorder'] == {'uri': 'again'}
    assert (order.bag.name, order.rate, order.settings.restart_limit) == ('recording', 0.5, 0)


@pytest.mark.parametrize(
    ('mounts', 'without', 'given', 'sentence'),
    [
        (['left', 'right'], '', {}, 'holds the mounts left, right: choose one of them as namespace'),
        ([''], '', {'namespace': 'left'}, "instead received 'left'"),
        ([''], 'displacement', {}, 'holds no displacement'),
        ([''], 'current_force_table', {}, 'holds no /current_force_table, without which the control'),
        ([''], '', {'record': 'true'}, 'a recording needs a folder'),
        ([''], '', {'bag': ''}, 'a replay needs a recorded drive'),
        ([''], '', {'rate': '0'}, 'rate:=0 must be above 0'),
        ([''], '', {'policy': 'fuzzy'}, 'fuzzy'),
        ([''], '', {'damper': 'progressive', 'policy': 'continuous_viscous'}, 'is for policy switched'),
        ([''], '', {'config': 'none.yaml'}, 'parameter file none.yaml'),
    ],
)  # fmt: skip
def test_what_cannot_be_played_is_refused_before_a_process_starts(record, mounts, without, given, sentence):
    bag = record(*mounts, without=without)
    with pytest.raises(ParameterError, match=sentence):
        ordered(**{'bag': bag, **given})


def test_the_player_gets_what_the_control_hears_and_the_latched_topics_stay_latched(tmp_path):
    command = play_command(tmp_path, '/car/left', 0.5)
    assert command[:4] == ['ros2', 'bag', 'play', str(tmp_path)]
    assert command[command.index('--topics') + 1 :] == [
        '/car/left/displacement', '/car/left/air_gap', '/car/left/current_force_table',
    ]  # fmt: skip
    offers = yaml.safe_load(offers_text('car/left'))
    assert [*offers] == ['/car/left/air_gap', '/car/left/current_force_table']
    assert {offer['durability'] for offer in offers.values()} == {'transient_local'}


@pytest.fixture
def player(tmp_path, monkeypatch):
    """Return the function that makes a player whose `ros2` is a text in Python."""
    (tmp_path / 'bin').mkdir()
    monkeypatch.setenv('PATH', str(tmp_path / 'bin'))

    def make(program):
        command = tmp_path / 'bin' / 'ros2'
        command.write_text(f'#!{sys.executable}\n{program}\n')
        command.chmod(0o755)
        return Player(tmp_path, '', 1.0)

    return make


def test_a_player_is_finished_at_its_end_and_a_failure_names_its_command(player):
    played = player('raise SystemExit(0)')
    assert not played.finished
    played.begin()
    wait_until(lambda: played.finished, 'the end')
    played.end()
    failed = player('raise SystemExit(2)')
    failed.begin()
    with pytest.raises(
        GraphError, match=r'ros2 bag play .* ended with code 2: it needs the packages ros2bag'
    ):
        wait_until(lambda: failed.finished, 'the end')
    failed.end()


def test_a_player_reads_the_offers_of_its_topics_and_leaves_no_file(player, tmp_path, monkeypatch):
    scratch = tmp_path / 'scratch'
    scratch.mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(scratch))
    played = player(
        'import sys; path = sys.argv[sys.argv.index("--qos-profile-overrides-path") + 1]\n'
        f'open({str(tmp_path / "read.yaml")!r}, "w").write(open(path).read())'
    )
    played.begin()
    wait_until(lambda: played.finished, 'the end')
    assert (tmp_path / 'read.yaml').read_text() == offers_text('')
    assert not list(scratch.iterdir())


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGTERM])
def test_a_player_ends_with_the_process_that_has_started_it(player, tmp_path, number):
    player('import os, time; print(os.getpid(), flush=True); time.sleep(100)')  # its program
    program = (
        'from pathlib import Path; from mount_bringup.graph.player import Player; import time\n'
        f'Player(Path({str(tmp_path)!r}), "", 1.0).begin(); time.sleep(100)'
    )
    starter = subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, text=True)
    playing = os.pidfd_open(int(starter.stdout.readline()))
    starter.send_signal(number)
    assert starter.wait(LIMIT) == -number
    assert select.select([playing], [], [], LIMIT)[0]
    os.close(playing)
    starter.stdout.close()


def test_a_player_that_goes_on_is_ended_and_one_that_is_not_there_is_told(player, tmp_path):
    going = player('import time; time.sleep(100)')
    going.begin()
    assert not going.finished
    going.end()
    assert going._process.poll() is not None
    shutil.rmtree(tmp_path / 'bin')
    with pytest.raises(GraphError, match='ros2 cannot be started'):
        Player(tmp_path, '', 1.0).begin()
