"""What Tab offers in the shells, and that it is what the code knows."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from engine_mount.cli.help import KINDS, named, recordings, setting

COMMAND = Path(sys.executable).with_name('engine-mount')
IN_BASH = """eval "$(engine-mount --show-completion bash)"
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_engine_mount_completion engine-mount
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.parametrize('kind', KINDS)
def test_every_kind_has_names(kind):
    offered = named(kind)('')
    assert offered
    assert all(name == str(name) and ' ' not in name for name in offered)


@pytest.mark.parametrize(
    ('complete', 'begun', 'value'),
    [
        (named('mount'), 'h', 'hydro'),
        (named('place'), 'left,r', 'left,right'),
        (named('fault'), 'right/coil_o', 'right/coil_open'),
        (setting, 'mount_sim.fric', 'mount_sim.friction.scale=1.0'),
    ],
)
def test_values_are_offered(complete, begun, value):
    offered = complete(begun)
    assert value in offered
    assert all(each.startswith(begun) for each in offered)


def test_runs_and_recordings_are_offered_the_newest_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert recordings('') == []
    for age, name in enumerate(('new', 'old')):
        place = tmp_path / 'bags' / name / ('recording' if age else '')
        place.mkdir(parents=True)
        (place / 'metadata.yaml').touch()
        os.utime(tmp_path / 'bags' / name, (1e9 - age, 1e9 - age))
    (tmp_path / 'bags' / 'empty').mkdir()
    assert recordings('') == ['bags/new', 'bags/old']
    assert recordings('bags/o') == ['bags/old']
    assert recordings('nowhere/') == []


@pytest.mark.skipif(shutil.which('bash') is None, reason='no bash')
@pytest.mark.parametrize(
    ('words', 'offered'),
    [
        (['rep'], ['report', 'replay']),
        (['dev', 'faults', '--only', 'coil_open,kill_d'], ['coil_open,kill_driver']),
    ],
)
def test_bash_is_offered_values(words, offered):
    path = f'{COMMAND.parent}{os.pathsep}{os.environ["PATH"]}'
    settings = {**os.environ, '_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION': '1', 'PATH': path}
    bash = ['bash', '--norc', '-c', IN_BASH, 'bash', 'engine-mount', *words]
    done = subprocess.run(bash, env=settings, capture_output=True, text=True, check=True)
    assert done.stdout.split() == offered
