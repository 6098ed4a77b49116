"""Parameter files read before a node starts: what they give to whom, and what is refused."""

import pytest

from mount_bringup.parameter_file import settings_of_file
from mount_models.quantity import ParameterError

KNOWN = {
    'mount_sim': {'seed': 1, 'timeline.duration': 20.0},
    'mount_control': {'eigenfrequency': 8.0, 'seed': 1},
}


@pytest.fixture
def read(tmp_path):
    file = tmp_path / 'car.yaml'

    def write_and_read(text, namespace=''):
        file.write_text(text)
        return settings_of_file(file, namespace, KNOWN)

    return write_and_read


def entry(pattern, values='{eigenfrequency: 9.0}'):
    return f'{pattern}:\n  ros__parameters: {values}\n'


@pytest.mark.parametrize(
    ('pattern', 'namespace', 'matches'),
    [
        ('/**/mount_control', '', True),
        ('/**/mount_control', '/car/mount_right', True),
        ('/*/mount_control', '', False),
        ('/*/mount_control', 'mount_right', True),
        ('/*/mount_control', 'car/mount_right', False),
        ('mount_control', '', True),
        ('/mount_control', 'mount_right', False),
        ('/mount_right/mount_control', '/mount_right/', True),
        ('/mount_left/mount_control', 'mount_right', False),
        ('/mount.right/mount_control', 'mount_right', False),
    ],
)
def test_an_entry_is_for_the_nodes_that_its_pattern_matches_as_in_ros(read, pattern, namespace, matches):
    expected = {'mount_control': {'eigenfrequency': 9.0}} if matches else {}
    assert read(entry(pattern), namespace) == expected


def test_nested_names_of_nodes_and_parameters_are_joined_and_the_later_entry_wins(read):
    text = entry('/**/mount_sim', '{seed: 2, timeline: {duration: 5}}') + (
        'mount_right:\n  mount_sim:\n    ros__parameters:\n      seed: 3\n'
    )
    assert read(text, 'mount_right') == {'mount_sim': {'seed': 3, 'timeline.duration': 5}}


def test_an_entry_for_every_node_is_for_those_that_have_the_parameter(read):
    assert read(entry('/**', '{seed: 4, eigenfrequency: 9}')) == {
        'mount_sim': {'seed': 4},
        'mount_control': {'seed': 4, 'eigenfrequency': 9},
    }


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (
            entry('/**/mount_control', '{eigenfrequncy: 9}'),
            "'eigenfrequncy' is no parameter of mount_control",
        ),
        (entry('/left/mount_control', '{eigenfrequncy: 9}'), 'did you mean eigenfrequency?'),
        (entry('/**', '{sede: 9}'), "'sede' is no parameter of mount_sim or mount_control"),
        (
            entry('/**/mount_kontrol'),
            "'../mount_kontrol' is no node of the graph; did you mean mount_control",
        ),
        (
            '/**/mount_control:\n  eigenfrequency: 9',
            '/mount_control/eigenfrequency must have ros__parameters',
        ),
        ('[1, 2]', 'must name nodes'),
        ('a: [', 'is not valid YAML'),
    ],
)
def test_what_nobody_would_read_is_refused(read, text, words):
    with pytest.raises(ParameterError, match=words):
        read(text)
