"""What the tests of all packages share: the fixtures of `mount_ros.testing`, and examples that repeat.

A job in the background of a shell ignores Ctrl-C, and so would all that the tests start and interrupt.

Hypothesis draws the same examples in every run, so that a test passes or fails by the code alone;
`pytest --hypothesis-profile=exploring` draws new ones, as many of each test as EXAMPLES says (100). No
example has a deadline: the first of a test may wait for the compiler.
"""

import os
import signal

from hypothesis import settings

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

pytest_plugins = ['mount_ros.testing']

settings.register_profile('repeatable', derandomize=True, deadline=None)
settings.register_profile(
    'exploring', derandomize=False, deadline=None, max_examples=int(os.environ.get('EXAMPLES', '100'))
)
settings.load_profile('repeatable')
