"""What a program has loaded at its end."""

import subprocess
import sys


def modules_after(program: str) -> set[str]:
    """Return the names of the modules that a process of its own has loaded after `program`."""
    told = subprocess.check_output([sys.executable, '-c', f'{program}; import sys; print(*sys.modules)'])
    return set(told.decode().split())
