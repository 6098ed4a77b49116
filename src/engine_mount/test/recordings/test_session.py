"""A session is read as it was written, and a text that is none says so."""

import math

import pytest

from engine_mount.recordings import open_recording
from engine_mount.recordings.session import (
    SessionError,
    recorded_session,
    session_content,
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
