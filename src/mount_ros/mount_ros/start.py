"""The executables of all nodes: until a node takes signals, Ctrl-C ends its process at once."""

import signal
import sys
from importlib import import_module
from pathlib import Path

_MODULES = {
    'mount_supervisor': 'mount_bringup.graph.run',
}
"""Modules of the executables; of any other one it is `node` in the package of the same name."""


def main() -> None:
    """Run the module of this executable; its import takes a second."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    name = Path(sys.argv[0]).name
    import_module(_MODULES.get(name, f'{name}.node')).main()
