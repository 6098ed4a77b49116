"""What a session says about versions."""

import subprocess

from mount_recorder.versions import _project_version, versions


def test_versions_tell_libraries_and_machine():
    told = versions()
    wanted = {'mount_bringup', 'numpy', 'scipy', 'numba', 'llvmlite', 'machine'}
    assert wanted <= set(told)
    assert all(told.values())


def test_the_state_of_the_repository_is_part_of_the_version(tmp_path):
    plain = _project_version(tmp_path)
    git = ('git', '-C', str(tmp_path), '-c', 'user.name=x', '-c', 'user.email=x@y')
    subprocess.run([*git, 'init', '-q'], check=True)
    (tmp_path / 'file').write_text('a')
    subprocess.run([*git, 'add', 'file'], check=True)
    subprocess.run([*git, 'commit', '-q', '-m', 'x'], check=True)
    committed = _project_version(tmp_path)
    (tmp_path / 'file').write_text('b')
    assert committed.startswith(f'{plain}+')
    assert _project_version(tmp_path) == f'{committed}-dirty'
