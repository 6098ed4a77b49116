"""Reference recordings: what a replay must meet, and how one is renewed."""

import numpy as np
import pytest
import yaml
from compared_drives import START, answers, write_answers
from reference_differences import differences_from_reference
from samples import joint_state

import engine_mount
from engine_mount.recordings.reference import (
    ACCEPTED_NAME,
    AcceptError,
    accept,
)
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message
from mount_ros.messages.force_table import table_message
from mount_ros.topics import (
    AIR_GAP,
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_FORCE_TABLE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    SESSION,
    SIM_MOUNT_FORCE,
)

COUNT, RAMP = 200, 40
INPUTS = (SESSION, AIR_GAP, CURRENT_FORCE_TABLE, DISPLACEMENT, COIL_RIPPLE, SIM_MOUNT_FORCE)
ANSWERS = (CURRENT_SETPOINT, CONTROL_TRACE)


def _run(folder, *, shift=0, topics=(*INPUTS, *ANSWERS), session='scenario: bench\n', count=COUNT, begin=0):
    """Write a run: setpoints from the beginning, traces after the ramp; damping `shift` samples later."""

    signals = answers(COUNT, on=80 + shift, off=150)
    writer = BagWriter(folder)
    for topic in topics:
        writer.add_topic(f'/{topic.name}', topic.type)

    def write(topic, raw, index):
        if topic in topics:
            writer.write(f'/{topic.name}', raw, START + index * 1_000_000)

    write(SESSION, string_message(session), 0)
    for index in range(begin, count):
        stamp = START + index * 1_000_000
        for topic in (DISPLACEMENT, COIL_RIPPLE, CURRENT_SETPOINT, CONTROL_TRACE):
            if topic is CONTROL_TRACE and index <= RAMP:
                continue
            source = 'displacement' if topic is DISPLACEMENT else 'current'
            row = [signals[name][index] if name in signals else 0.0 for name in topic.names]
            values = np.array(row if topic is CONTROL_TRACE else [signals[source][index]] * len(row))
            rates = values if topic.has_derivatives else np.empty(0)
            write(topic, joint_state(stamp, list(topic.names), values, rates), index)
        if index == RAMP:
            gap = joint_state(stamp, list(AIR_GAP.names), np.full(6, 4e-4), np.empty(0))
            write(AIR_GAP, gap, index)
            table = table_message(stamp, [[0.0, 1.0, 3.0], [0.0, 100.0, 900.0]])
            write(CURRENT_FORCE_TABLE, table, index)
    writer.close()
    return folder


@pytest.fixture
def references(tmp_path):
    return tmp_path / 'reference'


@pytest.fixture
def accepted(tmp_path, references):
    """Accept a run as the reference `bench` and return its folder."""
    return accept(
        engine_mount.open(_run(tmp_path / 'run')), 'bench', 'the first', references, {'numpy': '2'}
    ).folder


def test_a_reference_holds_what_a_replay_needs_and_no_more(accepted):
    recording = engine_mount.open(accepted)
    counts = {name: topic.message_count for name, topic in recording.topics.items()}
    assert counts == {
        '/session': 1,
        '/air_gap': 1,
        '/current_force_table': 1,
        '/displacement': COUNT,
        '/coil_ripple': RAMP + 1,
        '/current_setpoint': COUNT,
        '/control_trace': COUNT - RAMP - 1,
    }
    assert not recording.warnings


def test_the_reason_stays_with_the_reference(tmp_path, accepted, references):
    run = engine_mount.open(_run(tmp_path / 'later', shift=3))
    done = accept(run, 'bench', 'switching level raised', references)
    first, second = yaml.safe_load((accepted / ACCEPTED_NAME).read_text())
    assert (first['reason'], first['versions'], first['changes']) == (
        'the first',
        {'numpy': '2'},
        ['new reference'],
    )
    assert second['reason'] == 'switching level raised'
    assert second['changes'] == list(done.changes)
    assert second['changes'][0] == 'switched on 3 ms later in B, at 0.083 s'
    assert differences_from_reference(accepted, run) == []
    assert [path.name for path in references.iterdir()] == ['bench']


def test_a_replay_renews_the_answers_and_keeps_the_inputs(tmp_path, accepted, references):
    before = engine_mount.open(accepted)['displacement']['mount']
    replay = engine_mount.open(_run(tmp_path / 'replay', shift=3, topics=ANSWERS))
    accept(replay, 'bench', 'as wanted', references)
    renewed = engine_mount.open(accepted)
    assert (renewed['displacement']['mount'] == before).all()
    assert len(renewed['session']) == 1
    assert differences_from_reference(renewed, replay) == []


def test_a_reference_tells_no_path_of_the_machine_it_was_made_on(tmp_path, references):
    session = 'scenario: bench\nparameters:\n  mount_recorder: {uri: /somewhere/deep/recording}\n'
    run = engine_mount.open(_run(tmp_path / 'run', session=session))
    folder = accept(run, 'bench', 'the first', references).folder
    assert engine_mount.open(folder).latched('session').data == session.replace(
        '{uri: /somewhere/deep/recording}', '\n    uri: recording'
    ).replace('mount_recorder: \n', 'mount_recorder:\n')


@pytest.mark.parametrize(
    ('name', 'reason', 'why'),
    [('bench', '  ', 'only with a reason'), ('../bench', 'x', 'no name'), ('', 'x', 'no name')],
)
def test_without_a_reason_or_a_name_nothing_is_accepted(tmp_path, references, name, reason, why):
    with pytest.raises(AcceptError, match=why):
        accept(engine_mount.open(_run(tmp_path / 'run')), name, reason, references)
    assert not references.exists()


def test_an_equal_run_is_nothing_to_accept(tmp_path, accepted, references):
    with pytest.raises(AcceptError, match='nothing to accept'):
        accept(engine_mount.open(_run(tmp_path / 'again')), 'bench', 'why not', references)


@pytest.mark.parametrize('missing', [DISPLACEMENT, AIR_GAP, CURRENT_FORCE_TABLE, *ANSWERS])
def test_a_run_that_cannot_be_replayed_is_refused(tmp_path, references, missing):
    topics = tuple(topic for topic in (*INPUTS, *ANSWERS) if topic is not missing)
    with pytest.raises(AcceptError, match=missing.name):
        accept(engine_mount.open(_run(tmp_path / 'run', topics=topics)), 'bench', 'x', references)


def test_answers_to_other_samples_are_refused(tmp_path, accepted, references):
    other = write_answers(tmp_path / 'other', answers(COUNT), start=START + 317)
    piece = tmp_path / 'answers'
    writer = BagWriter(piece)
    for topic in ANSWERS:
        writer.add_topic(f'/{topic.name}', topic.type)
        writer.write(f'/{topic.name}', engine_mount.open(other)[topic.name].payloads[0], START)
    writer.close()
    with pytest.raises(AcceptError, match='answer none of the displacements'):
        accept(engine_mount.open(piece), 'bench', 'x', references)
