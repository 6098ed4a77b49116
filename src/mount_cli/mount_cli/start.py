"""The first step of the `engine-mount` command: Ctrl-C ends it in order while its modules are loaded."""

import os
import signal
from typing import Any

from mount_bringup.graph.shutdown import INTERRUPTED, interrupt_and_remember


def main() -> None:
    """Load the command and run it."""
    signal.signal(signal.SIGINT, _leave)
    os.environ['PYTHONSAFEPATH'] = '1'  # no child imports what lies in the working directory
    if os.environ.get('_ENGINE_MOUNT_COMPLETE') == 'complete_bash':
        from mount_cli.command import app
        from mount_cli.completion.bash import complete_in_bash

        complete_in_bash(app)
    from mount_cli.command import main as run

    signal.signal(signal.SIGINT, interrupt_and_remember)
    run()


def _leave(*_: Any) -> None:
    os.write(2, b'interrupted; nothing was started\n')
    os._exit(INTERRUPTED)
