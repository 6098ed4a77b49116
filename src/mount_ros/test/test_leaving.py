import subprocess
import sys

import pytest

from mount_ros.nodes.leaving import leave_middleware

_STUCK = """
import sys, threading
from mount_ros.nodes.leaving import end_process, leave_middleware
never = threading.Event()
threading.Thread(target=never.wait).start()  # as a thread of the middleware, which the interpreter waits for
print(leave_middleware(never.wait, 0.05), end='')
end_process(3)
"""


def test_taking_down_within_the_limit_is_told():
    steps = []
    assert leave_middleware(lambda: steps.append('down'))
    assert steps == ['down']


def test_what_goes_wrong_while_taking_down_is_not_swallowed():
    def fail():
        raise RuntimeError('no context')

    with pytest.raises(RuntimeError, match='no context'):
        leave_middleware(fail)


def test_a_process_ends_although_its_middleware_does_not():
    ended = subprocess.run([sys.executable, '-c', _STUCK], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (3, 'False', '')
