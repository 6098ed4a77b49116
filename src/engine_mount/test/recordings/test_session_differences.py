"""Two sessions in words."""

from engine_mount.recordings.session import session_differences


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
