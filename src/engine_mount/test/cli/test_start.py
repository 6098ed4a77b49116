"""The command imports nothing from the working directory, and its status ends with a reason."""

import contextlib
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from engine_mount.cli.commands import faults, view
from engine_mount.view import view as looking
from engine_mount.view.feed import FeedError
from mount_ros import environment


@pytest.mark.parametrize('path', [':/nowhere', '/nowhere:', ':'])
def test_an_empty_part_of_the_path_is_not_the_working_directory(tmp_path, path):
    for module in ('yaml', 'typer', 'queue'):
        (tmp_path / f'{module}.py').write_text('raise SystemExit("foreign code ran")')
    ended = subprocess.run(
        [sys.executable, '-P', '-c', 'from engine_mount.cli.start import main; main()', '--help'],
        cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': path},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (0, '')


def test_a_drive_of_the_fault_matrix_imports_nothing_from_the_working_directory(tmp_path):
    (tmp_path / 'yaml.py').write_text('raise SystemExit("foreign code ran")')
    environment = {name: value for name, value in os.environ.items() if name != 'PYTHONSAFEPATH'}
    ended = subprocess.run(
        [*faults._DRIVE, '--help'], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert (ended.returncode, ended.stderr) == (0, '')


def test_status_ends_with_the_reason_when_its_model_fails(monkeypatch):
    model = SimpleNamespace(failure='the view has ended: ValueError: broken')
    feed = contextlib.nullcontext(SimpleNamespace(title='a graph'))
    monkeypatch.setattr(looking, 'open_feed', lambda **options: feed)
    monkeypatch.setattr(looking, 'running_model', lambda _, **options: contextlib.nullcontext(model))
    monkeypatch.setattr('engine_mount.view.view.status_screen', lambda *_: 'figures')
    with pytest.raises(FeedError, match='the view has ended: ValueError: broken'):
        view.status(domain=5)


def test_status_says_that_the_loopback_interface_is_down(monkeypatch):
    monkeypatch.setattr(environment, '_NEIGHBOUR', ('255.255.255.255', 9))  # refused without a flag
    with pytest.raises(FeedError, match='the loopback interface is down'):
        view.status(once=True, domain=5)
