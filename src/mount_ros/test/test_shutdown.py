import subprocess
import sys

import pytest

from mount_ros.nodes.shutdown import leave_middleware

_STUCK = """
import sys, threading
from mount_ros.nodes.shutdown import end_process, leave_middleware
never = threading.Event()
threading.Thread(target=never.wait).start()  # as a thread of the middleware, which the interpreter waits for
print(leave_middleware(never.wait, 0.05), end='')
end_process(3)
"""


_STUCK_WITH_THE_INTERPRETER = """
import ctypes, functools, time
from mount_ros.nodes.shutdown import leave_middleware
leave_middleware(lambda: None, last=0.3)
time.sleep(0.5)
keeping = ctypes.PyDLL(None)  # its functions keep the interpreter
print('last words', end='', flush=True)
leave_middleware(functools.partial(keeping.sleep, 600), last=0.3)
"""


def test_what_goes_wrong_while_taking_down_is_not_swallowed():
    def fail():
        raise RuntimeError('no context')

    with pytest.raises(RuntimeError, match='no context'):
        leave_middleware(fail)


def test_a_process_ends_although_its_middleware_does_not():
    ended = subprocess.run([sys.executable, '-c', _STUCK], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (3, 'False', '')


def test_a_process_ends_although_its_middleware_keeps_the_interpreter_and_goes_on_where_it_has_left():
    program = [sys.executable, '-c', _STUCK_WITH_THE_INTERPRETER]
    ended = subprocess.run(program, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (1, 'last words')
    assert 'in attempt' in ended.stderr
