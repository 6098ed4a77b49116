"""The same bytes on every processor: drives, references and replays under emulated ones.

Libraries choose among variants of the same function by the processor that they find. What they find can be
set from outside, so one machine shows what others would do. Where a setting means nothing, as those of an
x86-64 on an aarch64, the process is one more repetition.
"""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from references import REFERENCES, REFERENCES_FOLDER

from .made_here import CONTROLS, differences_of

LIMIT = 600.0  # s: only a hang takes so long; the first time a process compiles the laws for its processor
RECORDINGS = [*CONTROLS, *(f'replays/{folder.name}/recording' for folder in REFERENCES)]

NO_FEATURES = ' '.join(feature for feature in __cpu_dispatch__ if __cpu_features__[feature])
BASELINE = 'Prescott, nothing but the baseline'
NO_FMA = 'glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-FMA4'
EMULATED = {
    'Haswell': {'OPENBLAS_CORETYPE': 'Haswell'},
    'SkylakeX': {'OPENBLAS_CORETYPE': 'SkylakeX'},
    'Zen': {'OPENBLAS_CORETYPE': 'Zen'},
    'Sandybridge without kernels of numpy': {
        'OPENBLAS_CORETYPE': 'Sandybridge',
        'NPY_DISABLE_CPU_FEATURES': NO_FEATURES,
    },
    'C library without FMA and AVX2': {'GLIBC_TUNABLES': NO_FMA},
    BASELINE: {
        'OPENBLAS_CORETYPE': 'Prescott',
        'GLIBC_TUNABLES': NO_FMA,
        'NUMBA_CPU_NAME': 'generic',
        'NPY_DISABLE_CPU_FEATURES': NO_FEATURES,
    },
}


def made(folder: Path, emulation: dict[str, str], *recording: Path) -> dict[str, Any]:
    """Return what a process with this processor says about what it made in `folder`."""
    settings = {name for each in EMULATED.values() for name in each}
    inherited = {name: value for name, value in os.environ.items() if name not in settings}
    process = subprocess.run(
        [sys.executable, Path(__file__).with_name('made_here.py'), folder, REFERENCES_FOLDER, *recording],
        env={**inherited, **emulation}, capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout.splitlines()[-1])


def unmet(said: dict[str, Any]) -> list[str]:
    return [f'the replay of {name} is not what was recorded' for name, met in said['met'].items() if not met]


@pytest.mark.parametrize('names', [[BASELINE], pytest.param(list(EMULATED), marks=pytest.mark.slow)], ids=len)
def test_every_processor_makes_and_repeats_the_same_bytes(tmp_path, names):
    plain = made(tmp_path / 'plain', {})
    told, seen = unmet(plain), {}
    for name, emulation in ((name, EMULATED[name]) for name in names):
        said = made(tmp_path / name, emulation, *(tmp_path / 'plain' / each for each in CONTROLS))
        found = [*differences_of(tmp_path / 'plain', tmp_path / name, RECORDINGS), *unmet(said)]
        told += [f'{name}: {text}' for text in found]
        seen[name] = said['seen']
    assert not told, '\n'.join(told)
    if platform.machine() == 'x86_64':
        check_that_libraries_were_deceived(plain['seen'], seen)


def check_that_libraries_were_deceived(plain: dict[str, Any], seen: dict[str, Any]) -> None:
    """An emulation that changes nothing would prove nothing."""
    baseline = seen[BASELINE]
    assert baseline['numpy'] == []
    assert baseline['numba'] == 'generic no fma'
    if len(seen) < len(EMULATED):
        return
    if any('openblas' in each for each in plain['blas']):
        kernels = {each for said in seen.values() for each in said['blas']}
        assert len(kernels) >= 4, kernels  # for Zen it takes those of Haswell
    if ' fma ' in Path('/proc/cpuinfo').read_text() and platform.libc_ver()[0] == 'glibc':
        assert seen['C library without FMA and AVX2']['c_library'] != plain['c_library']
