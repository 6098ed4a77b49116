"""With what answers are made here: versions, C library, processor."""

import functools
import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

_LIBRARIES = ('rclpy', 'numpy', 'scipy', 'numba', 'llvmlite', 'mcap', 'python-can', 'cantools')
_FLAGS = ('sse4_2', 'avx2', 'fma', 'fma4', 'avx512f', 'asimd', 'sve')
"""Abilities of a processor by which libraries choose between variants of the same function."""
_CPUINFO = Path('/proc/cpuinfo')


@functools.cache
def versions() -> dict[str, str]:
    """Return {what: version} of this project and of all that it runs on, the processor included."""
    return {
        'python': platform.python_version(),
        'mount_bringup': _project_version(Path(__file__).resolve().parents[3]),
        **{name: _library_version(name) for name in _LIBRARIES},
        'c_library': _c_library(),
        'machine': platform.machine(),
        'processor': processor(_CPUINFO.read_text(encoding='utf-8') if _CPUINFO.is_file() else ''),
    }


def processor(cpuinfo: str) -> str:
    """Return the name of the first processor in a text as of /proc/cpuinfo, and its abilities that matter."""
    values: dict[str, str] = {}
    for line in cpuinfo.split('\n\n')[0].splitlines():
        name, _, value = line.partition(':')
        values[name.strip()] = value.strip()
    part = f'implementer {values.get("CPU implementer", "unknown")} part {values.get("CPU part", "unknown")}'
    abilities = values.get('flags', values.get('Features', '')).split()
    known = [flag for flag in _FLAGS if flag in abilities]
    return f'{values.get("model name", part)} ({" ".join(known) or "no abilities known"})'


def _project_version(repository: Path) -> str:
    """Return the version of the package and, in a repository, what Git calls its state."""
    version = _library_version('mount_bringup')
    if not (repository / '.git').exists():
        return version
    try:
        described = subprocess.run(
            ['git', '--no-optional-locks', '-C', str(repository), 'describe', '--always', '--dirty'],
            capture_output=True, text=True, timeout=10.0, check=True,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return version
    return f'{version}+{described.stdout.strip()}'


def _library_version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return 'unknown'  # installed from Debian packages without metadata


def _c_library() -> str:
    try:
        return os.confstr('CS_GNU_LIBC_VERSION') or 'unknown'
    except ValueError:
        return 'unknown'
