"""With what answers are made here: versions of the project, of Python and of its libraries."""

import functools
import platform
import subprocess
from importlib import metadata
from pathlib import Path

_LIBRARIES = ('rclpy', 'numpy', 'scipy', 'numba', 'llvmlite', 'mcap', 'python-can', 'cantools')


@functools.cache
def versions() -> dict[str, str]:
    """Return {what: version} of this project and of all that it runs on, the kind of machine included."""
    return {
        'python': platform.python_version(),
        'mount_bringup': _project_version(Path(__file__).resolve().parents[3]),
        **{name: _library_version(name) for name in _LIBRARIES},
        'machine': platform.machine(),
    }


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
