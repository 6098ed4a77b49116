"""What a replay says about the versions that a recording was made with."""

import pytest

from engine_mount.recordings.session import version_differences, versions_sentence

HERE = {'numpy': '2.4.6', 'numba': '0.68.1', 'machine': 'x86_64'}


@pytest.mark.parametrize(
    ('session', 'sentence'),
    [
        ({'versions': HERE}, 'made with the same versions on the same kind of machine'),
        (
            {'versions': {'numpy': '2.4.5'}},
            'made with others than here: numpy 2.4.5 (here 2.4.6); it does not tell numba, machine',
        ),
        (
            {'versions': {'numpy': '2.4.6'}},
            'made with the same versions as far as it tells; it does not tell numba, machine',
        ),
        ({'versions': HERE, 'replay': {'versions': {**HERE, 'numpy': '1'}}}, 'numpy 1 (here 2.4.6)'),
        ({}, 'does not tell with which versions it was made'),
    ],
)
def test_a_replay_says_which_versions_differ_and_that_none_does(session, sentence):
    assert sentence in versions_sentence(version_differences(session, HERE), HERE)
