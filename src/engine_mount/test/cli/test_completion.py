"""What Tab offers in the shells, and that it is what the code knows."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from engine_mount.cli.completion import KINDS, faults, listed, named, recordings, references, setting

COMMAND = Path(sys.executable).with_name('engine-mount')
WITHOUT_DETECTION = {'_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION': '1'}
IN_BASH = """eval "$(engine-mount --show-completion bash)"
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_engine_mount_completion engine-mount
printf '%s\\n' "${COMPREPLY[@]}"
"""


def environment(**others: str) -> dict[str, str]:
    path = f'{COMMAND.parent}{os.pathsep}{os.environ["PATH"]}'
    return {**os.environ, **WITHOUT_DETECTION, 'PATH': path, **others}


@pytest.mark.parametrize('kind', KINDS)
def test_every_kind_has_names(kind):
    offered = named(kind)('')
    assert offered
    assert all(name == str(name) and ' ' not in name for name in offered)


@pytest.mark.parametrize(
    ('complete', 'begun', 'value'),
    [
        (named('scenario'), '', 'recorded'),
        (named('mount'), 'h', 'hydro'),
        (named('experiment'), 'saw', 'sawtooth'),
        (listed('place'), 'left,r', 'left,right'),
        (faults, 'right/coil_o', 'right/coil_open'),
        (faults, '', 'list'),
        (setting, 'mount_control.pol', 'mount_control.policy=continuous_viscous'),
        (setting, 'left/mount_control.policy=s', 'left/mount_control.policy=switched_viscous'),
    ],
)
def test_values_are_offered(complete, begun, value):
    offered = complete(begun)
    if '=' in value and '=' not in begun:  # the default may change
        value, offered = value.split('=')[0], [each.split('=')[0] for each in offered]
    assert value in offered
    assert all(each.startswith(begun) for each in offered)


def test_a_name_that_is_listed_already_is_not_offered_again():
    assert 'left,left' not in listed('place')('left,')
    assert not setting('mount_sim.seed=')


def test_runs_and_recordings_are_offered_the_newest_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert recordings('') == []
    for age, name in enumerate(('new', 'old')):
        place = tmp_path / 'bags' / name / ('recording' if age else '')
        place.mkdir(parents=True)
        (place / 'metadata.yaml').touch()
        os.utime(tmp_path / 'bags' / name, (1e9 - age, 1e9 - age))
    (tmp_path / 'bags' / 'empty').mkdir()
    (tmp_path / 'bags' / 'reference' / 'gap').mkdir(parents=True)
    assert recordings('') == ['bags/new', 'bags/old']
    assert recordings('bags/o') == ['bags/old']
    assert recordings('nowhere/') == []
    assert references('g') == ['gap']


@pytest.mark.skipif(shutil.which('bash') is None, reason='no bash')
@pytest.mark.parametrize(
    ('words', 'offered'),
    [
        (['rep'], ['report', 'replay']),
        (['drive', '--scenario', 'm'], ['motorway']),
        (['faults', '--only', 'coil_open,kill_d'], ['coil_open,kill_driver']),
    ],
)
def test_bash_is_offered_values(words, offered):
    bash = ['bash', '--norc', '-c', IN_BASH, 'bash', 'engine-mount', *words]
    done = subprocess.run(bash, env=environment(), capture_output=True, text=True, check=True)
    assert done.stdout.split() == offered


@pytest.mark.parametrize(
    ('shell', 'answer'),
    [('zsh', '"motorway"'), ('fish', 'motorway')],
)
def test_the_other_shells_are_answered_in_their_words(shell, answer):
    asked = {
        '_ENGINE_MOUNT_COMPLETE': f'complete_{shell}',
        '_TYPER_COMPLETE_ARGS': 'engine-mount drive --scenario mo',
        '_TYPER_COMPLETE_FISH_ACTION': 'get-args',
    }
    done = subprocess.run([COMMAND], env=environment(**asked), capture_output=True, text=True)
    assert answer in done.stdout
    assert 'bench' not in done.stdout
