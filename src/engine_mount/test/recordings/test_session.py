"""A session is read as it was written, and a text that is none says so."""

import math

import pytest

from engine_mount.recordings import open_recording
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
    session_differences,
    session_parameters,
)
from mount_recorder.bag_writer import BagWriter
from mount_recorder.session import new_session, session_text
from mount_recorder.versions import versions
from mount_ros.messages.cdr import string_message
from mount_ros.topics import SESSION


def recorded(folder, *names: str):
    writer = BagWriter(folder)
    for name in names:
        writer.add_topic(name, SESSION.type)
        writer.write(name, string_message(session_text({'scenario': name})), 1)
    writer.close()
    return open_recording(folder)


def test_a_session_is_read_as_it_was_made():
    made = new_session({'mode': 'core', 'parameters': {'mount_init': {'coil_temperature_celsius': math.inf}}})
    assert list(made) == ['mode', 'parameters', 'started', 'versions']
    assert made['versions'] == versions()
    assert session_content(session_text(made)) == made


def test_a_recording_of_one_mount_has_one_session_and_one_of_several_none_for_all(tmp_path):
    assert 'scenario: /right/session' in recorded_session(recorded(tmp_path / 'one', '/right/session'))
    assert recorded_session(recorded(tmp_path / 'two', '/left/session', '/right/session')) == ''
    both = recorded(tmp_path / 'both', '/session', '/right/session')
    assert recorded_session(both) == 'scenario: /session\n'


def test_what_is_no_session_is_refused_in_words():
    assert session_content('') == {}
    with pytest.raises(SessionError, match='session is not valid YAML in line 2'):
        session_content('one: [')
    with pytest.raises(SessionError, match='is a list'):
        session_content('[1]')


def test_parameters_that_are_none_are_left_out():
    assert session_parameters({'parameters': {'a': {'b': 1}, 'c': 3}}) == {'a': {'b': 1}}
    assert session_parameters({'parameters': 3}) == {}


# Two sessions in words.


def test_changed_parameters_come_first_and_by_their_names():
    a = 'parameters:\n  mount_control: {quality: 0.7, lead_time: 0.01}\nversions: {numpy: "2.0"}\n'
    b = 'parameters:\n  mount_control: {quality: 0.9, gain: 1}\nversions: {numpy: "2.1"}\n'
    assert session_differences(a, b) == [
        'mount_control.quality is 0.7 in A, 0.9 in B',
        'versions.numpy is 2.0 in A, 2.1 in B',
        'only A tells mount_control.lead_time (0.01)',
        'only B tells mount_control.gain (1)',
    ]


def test_what_differs_in_every_run_is_not_told():
    a, b = (f'started: {word}\nparameters:\n  mount_recorder: {{uri: {word}}}\n' for word in 'xy')
    assert session_differences(a, b) == []


def test_sessions_that_are_no_yaml_are_compared_as_texts():
    assert session_differences('one: [', 'two: [') == ['text is one: [ in A, two: [ in B']


def test_what_is_unknown_in_both_is_no_difference():
    unknown = 'parameters:\n  mount_init: {coil_temperature_celsius: .nan}\n'
    assert session_differences(unknown, unknown) == []
    known = unknown.replace('.nan', '20.0')
    assert session_differences(unknown, known) == ['mount_init.coil_temperature_celsius is nan in A, 20 in B']
