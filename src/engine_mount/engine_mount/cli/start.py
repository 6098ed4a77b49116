"""The first step of the `engine-mount` command: Ctrl-C ends it in order while its modules are loaded.

Modules are imported once the working directory, where foreign ones may lie, is no place for them.
"""

import os
import sys


def main() -> None:
    """Load the command and run it."""
    _leave_out_working_directory()
    import signal

    signal.signal(signal.SIGINT, _leave)
    os.environ['PYTHONSAFEPATH'] = '1'  # no child imports what lies in the working directory
    from engine_mount.cli.command import main as run
    from mount_bringup.graph.shutdown import interrupt_and_remember

    signal.signal(signal.SIGINT, interrupt_and_remember)
    run()


def _leave_out_working_directory() -> None:
    """Remove it from the path where an empty part of PYTHONPATH has put it there."""
    parts = os.environ.get('PYTHONPATH', '').split(os.pathsep)
    if len(parts) == 1 or '' not in parts:
        return
    os.environ['PYTHONPATH'] = os.pathsep.join(filter(None, parts))
    here = os.getcwd()
    sys.path[:] = [entry for entry in sys.path if entry and (entry in parts or entry != here)]


def _leave(*_: object) -> None:
    os.write(2, b'interrupted; nothing was started\n')
    os._exit(130)  # `INTERRUPTED`: nothing is imported amid an import
