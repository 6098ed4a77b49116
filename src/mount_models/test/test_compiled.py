"""The cache of compiled laws follows every source that a law may call, and keeps processors apart."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mount_models.arithmetic import compiled


def test_packages_that_a_file_imports_belong_to_its_digest(tmp_path, monkeypatch):
    for package, text in {'mount_far': 'X = 1\n', 'mount_near': 'from mount_far import part\n'}.items():
        (tmp_path / package).mkdir()
        (tmp_path / package / '__init__.py').touch()
        (tmp_path / package / 'part.py').write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    behind = compiled._packages_behind(tmp_path / 'mount_near' / 'part.py')
    assert set(behind) == {
        tmp_path / 'mount_near',
        tmp_path / 'mount_far',
        Path(compiled.__file__).resolve().parents[1],
    }
    before = compiled._sources_digest(behind)
    (tmp_path / 'mount_far' / 'part.py').write_text('X = 2\n')
    compiled._sources_digest.cache_clear()
    assert compiled._sources_digest(behind) != before


@pytest.mark.slow
def test_code_for_one_processor_is_not_taken_for_another(tmp_path):
    plain = {name: value for name, value in os.environ.items() if name != 'NUMBA_CPU_NAME'}
    for names in ({}, {'NUMBA_CPU_NAME': 'generic'}, {'NUMBA_CPU_NAME': 'generic'}):
        subprocess.run(
            [sys.executable, '-c', 'from mount_models.arithmetic.elementary import exp; exp(1.0)'],
            env={**plain, 'XDG_CACHE_HOME': str(tmp_path), **names}, check=True,
        )  # fmt: skip
    assert len(list(tmp_path.rglob('elementary.exp-*.nbc'))) == 2


def test_a_function_is_compiled_with_names_bound_anew_and_cached_by_its_name(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    doubled, trebled = (
        compiled.specialised(scaled, f'by_{factor:.0f}', {'FACTOR': factor}) for factor in (2.0, 3.0)
    )
    assert (scaled(5.0), doubled(5.0), trebled(5.0)) == (5.0, 10.0, 15.0)
    cached = {file.name.split('-')[0] for file in tmp_path.rglob('*.nbi')}
    assert cached == {'test_compiled.by_2.scaled', 'test_compiled.by_3.scaled'}


def test_a_compilation_is_told_once_and_not_where_its_result_is_on_disk(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))

    def told():
        sentences = []
        first, second = (compiled.specialised(scaled, name, {'FACTOR': 2.0}) for name in ('first', 'second'))
        with compiled.log_compilation(sentences.append):
            first(5.0)
            second(5.0)
        return sentences

    [sentence] = told()
    assert sentence.startswith('compiling laws for this machine')
    assert told() == []


FACTOR = 1.0


def scaled(number):
    """The number times what `FACTOR` is where it is compiled."""
    return FACTOR * number
