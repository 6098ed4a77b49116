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
import ctypes, functools
from mount_ros.nodes.shutdown import leave_middleware
keeping = ctypes.PyDLL(None)  # its functions keep the interpreter
print('last words', end='')
leave_middleware(functools.partial(keeping.sleep, 600), code={code}, last=0.3)
"""
_LEFT = """
import time
from mount_ros.nodes.shutdown import leave_middleware
leave_middleware(lambda: None, last=2.0)
time.sleep(2.5)
print('goes on', end='')
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


@pytest.mark.parametrize('code', [0, 1])
def test_a_process_ends_although_its_middleware_keeps_the_interpreter(code):
    program = _STUCK_WITH_THE_INTERPRETER.format(code=code)
    ended = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, 'last words', '')


def test_a_process_that_has_left_goes_on():
    ended = subprocess.run([sys.executable, '-c', _LEFT], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, 'goes on', '')


_SET = """
import ctypes, time
from mount_ros.nodes.shutdown import Deadline
deadline = Deadline(7)
deadline.set(2.0)
deadline.set(0.0)
time.sleep(2.5)
print('called off', end='', flush=True)
deadline.set(0.5)
ctypes.PyDLL(None).sleep(60)  # keeps the interpreter
"""


def test_a_deadline_ends_the_process_unless_it_is_called_off():
    ended = subprocess.run([sys.executable, '-c', _SET], capture_output=True, text=True, timeout=50)
    assert (ended.returncode, ended.stdout, ended.stderr) == (7, 'called off', '')
