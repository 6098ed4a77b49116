"""What a session says about versions and processor."""

import subprocess

import pytest

from mount_recorder.versions import _project_version, processor, versions

X86 = """processor\t: 0
vendor_id\t: AuthenticAMD
model name\t: AMD EPYC
flags\t\t: fpu sse2 avx fma sse4_2 avx2 avx512f avx512bw

processor\t: 1
model name\t: another
"""
ARM = """processor\t: 0
Features\t: fp asimd evtstrm sve
CPU implementer\t: 0x41
CPU part\t: 0xd40
"""


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        (X86, 'AMD EPYC (sse4_2 avx2 fma avx512f)'),
        (ARM, 'implementer 0x41 part 0xd40 (asimd sve)'),
        ('', 'implementer unknown part unknown (no abilities known)'),
    ],
)
def test_a_processor_is_told_by_its_name_and_the_abilities_by_which_libraries_choose(text, told):
    assert processor(text) == told


def test_versions_tell_libraries_c_library_and_processor():
    told = versions()
    wanted = {'mount_bringup', 'numpy', 'scipy', 'numba', 'llvmlite', 'c_library', 'machine', 'processor'}
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
